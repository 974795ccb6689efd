#include "rig/finding/face_search.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

#include "rig/finding/pose_search.h"
#include "rig/finding/symmetry.h"

namespace volto::rig {
namespace {

constexpr std::size_t kPlanes = 4;
constexpr double kWorthStudying = 0.25;  // likeness at a glance

// How much is tried.
struct Effort {
  std::size_t candidates, studied;
  double smallest;  // eye separation, in root mean squares of the samples
};
constexpr Effort kWhole{12, 2, 0.09};
constexpr Effort kPart{6, 1, 0.3};  // the part is about as large as a head

// Samples as a cloud of its own: centroid at the origin, root mean square distance 1.
struct Cloud {
  std::vector<SurfaceSample> samples;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  double size = 1;

  explicit Cloud(std::span<const SurfaceSample> of) : samples(of.begin(), of.end()) {
    for (const SurfaceSample& s : samples) centre += s.position / static_cast<double>(samples.size());
    double sum = 0;
    for (const SurfaceSample& s : samples) sum += (s.position - centre).squaredNorm();
    size = std::sqrt(std::max(sum / static_cast<double>(samples.size()), 1e-12));
    for (SurfaceSample& s : samples) s.position = (s.position - centre) / size;
  }
  FaceFrame outside(FaceFrame frame) const {
    frame.origin = centre + size * frame.origin;
    frame.size *= size;
    return frame;
  }
};

// The frame's plane of symmetry made that of the face alone, whatever the rest of the mesh does.
FaceFrame onItsOwnPlane(std::span<const SurfaceSample> samples, FaceFrame frame, double* error) {
  SymmetryPlane plane;
  plane.normal = frame.mesh_from_head.col(0);
  plane.offset = plane.normal.dot(frame.origin);
  plane = refineSymmetryPlane(samples, plane, frame.toMesh({0, -0.4, -0.5}), 1.8 * frame.size, error);
  frame.mesh_from_head =
      Eigen::Quaterniond::FromTwoVectors(frame.mesh_from_head.col(0), plane.normal) * frame.mesh_from_head;
  frame.origin -= (plane.normal.dot(frame.origin) - plane.offset) * plane.normal;
  return frame;
}

void searchOnPlanes(const NormalisedSurface& surface, const Cloud& cloud, std::span<const SymmetryPlane> planes,
                    const Effort& effort, SearchResult& result) {
  if (planes.empty()) return;
  std::vector<FaceMatch> glances;
  for (const PoseCandidate& pose : searchPoses(cloud.samples, planes, effort.candidates, effort.smallest))
    glances.push_back(glanceAtFace(surface, cloud.outside(pose.frame)));
  result.planes += planes.size();
  result.poses += glances.size();
  std::stable_sort(glances.begin(), glances.end(),
                   [](const FaceMatch& a, const FaceMatch& b) { return a.likeness > b.likeness; });
  // The better ones are studied: a candidate that lies a little off may be the best face.
  for (std::size_t k = 0; k < std::min(effort.studied, glances.size()); ++k) {
    if (glances[k].likeness < kWorthStudying) {
      if (glances[k].likeness > result.best.likeness) result.best = glances[k];
      break;
    }
    FaceMatch match = studyFace(surface, glances[k].frame);
    if (match.likeness > result.best.likeness) result.best = std::move(match);
    if (result.best.likeness > 0.85) break;
  }
}

void searchCloud(const NormalisedSurface& surface, const Cloud& cloud, const Effort& effort, bool thorough,
                 SearchResult& result) {
  const std::vector<SymmetryPlane> planes = findSymmetryPlanes(cloud.samples, kPlanes);
  if (planes.empty()) return;
  result.best_mirrored = std::max(result.best_mirrored, planes.front().score);
  std::size_t good = 1;
  while (good < planes.size() && planes[good].score > 0.85 * planes.front().score) ++good;
  searchOnPlanes(surface, cloud, std::span(planes).first(good), effort, result);
  if (result.best.likeness < kFaceLikeness && thorough)
    searchOnPlanes(surface, cloud, std::span(planes).subspan(good), effort, result);
}

// Balls that cover the samples: a head on a body that is not symmetric has a plane of its own.
std::vector<std::vector<SurfaceSample>> parts(std::span<const SurfaceSample> samples, double radius, std::size_t most) {
  std::vector<std::vector<SurfaceSample>> result;
  std::vector<double> distance(samples.size(), 1e30);
  std::size_t centre = 0;
  for (std::size_t i = 0; i < samples.size(); ++i)
    if (samples[i].position.squaredNorm() > samples[centre].position.squaredNorm()) centre = i;
  while (result.size() < most) {
    std::vector<SurfaceSample> part;
    std::size_t farthest = 0;
    for (std::size_t i = 0; i < samples.size(); ++i) {
      const double d = (samples[i].position - samples[centre].position).norm();
      if (d < radius) part.push_back(samples[i]);
      distance[i] = std::min(distance[i], d);
      if (distance[i] > distance[farthest]) farthest = i;
    }
    if (part.size() > 200) result.push_back(std::move(part));
    if (distance[farthest] < 0.8 * radius) break;
    centre = farthest;
  }
  return result;
}

}  // namespace

SearchResult searchFace(const NormalisedSurface& surface, std::span<const SurfaceSample> samples, bool thorough) {
  SearchResult result;
  const Cloud cloud(samples);
  searchCloud(surface, cloud, kWhole, thorough, result);
  if (result.best.likeness < kFaceLikeness && thorough)
    for (const std::vector<SurfaceSample>& part : parts(samples, 0.7 * cloud.size, 5)) {
      searchCloud(surface, Cloud(part), kPart, false, result);
      if (result.best.likeness > kFaceLikeness) break;
    }
  if (result.poses == 0) return result;
  const FaceFrame frame = onItsOwnPlane(samples, result.best.frame, &result.symmetry_error);
  FaceMatch turned = studyFace(surface, frame);
  if (turned.likeness > result.best.likeness - 0.02) result.best = std::move(turned);
  return result;
}

}  // namespace volto::rig
