#include "rig/finding/find_face.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string_view>

#include <Eigen/Geometry>

#include "rig/finding/face_match.h"
#include "rig/finding/pose_search.h"
#include "rig/finding/winding.h"

namespace volto::rig {
namespace {

constexpr std::size_t kSamples = 8000;
constexpr std::size_t kPlanes = 4;
constexpr std::size_t kCandidates = 12;

// Those that a face's relief shows well.
constexpr std::string_view kLandmarks[] = {"3.7", "3.11", "3.8", "3.12", "12.13", "9.3", "9.15",
                                           "9.1", "9.2",  "8.3", "8.4",  "8.1",   "8.2", "2.10"};

std::string number(double value, const char* format) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), format, value);
  return text.data();
}

// A face's relief is more than 0.8 alike to the generic one's, a stylised one's about 0.6; what is no face stays below
// 0.5 (tests/rig/finding_test.cpp).
double confidenceOf(const FaceMatch& match) { return 1 / (1 + std::exp(-(match.mean() - 0.55) / 0.06)); }

void checkMesh(const Mesh& mesh, const FindOptions& options) {
  if (mesh.polygonCount() == 0) throw InputError("looked for a face and found no polygons");
  if (mesh.vertexCount() > options.max_vertices)
    throw InputError("the mesh has " + std::to_string(mesh.vertexCount()) +
                     " vertices; a face is looked for on up to " + std::to_string(options.max_vertices) +
                     ": decimate it, or give landmarks");
}

bool sameFace(const FaceFrame& a, const FaceFrame& b) {
  return (a.toMesh({0, -0.5, 0}) - b.toMesh({0, -0.5, 0})).norm() < 1.2 * std::max(a.size, b.size);
}

std::vector<RoughLandmark> landmarksOf(const FaceMatch& match, const NormalisedSurface& surface, double confidence) {
  std::vector<RoughLandmark> landmarks;
  for (const std::string_view id : kLandmarks) {
    const std::size_t point = *featurePointIndex(id);
    const Eigen::Vector3d generic = faceTemplate().landmarks.row(static_cast<Eigen::Index>(point));
    const Eigen::Vector2d p = match.flow.carry(generic.head<2>());
    const Eigen::Vector2d at = Relief::pixelsOf(p.x(), p.y(), match.relief.pixel);
    const double z = match.relief.depth.sample(static_cast<float>(at.x()), static_cast<float>(at.y()));
    RoughLandmark landmark;
    landmark.feature_point = point;
    landmark.position = surface.centre + surface.size * match.frame.toMesh({p.x(), p.y(), z});
    landmark.confidence = confidence * likenessAround(match, generic.head<2>(), 0.2);
    landmarks.push_back(landmark);
  }
  return landmarks;
}

}  // namespace

FoundFace findFace(const Mesh& mesh, const FindOptions& options) {
  checkMesh(mesh, options);
  const NormalisedSurface surface = normaliseSurface(mesh);
  const std::vector<SurfaceSample> samples = sampleVisibleSurface(surface, kSamples);
  if (samples.size() < 100)
    throw InputError("looked for a face and found next to no surface that is seen from outside");
  const std::vector<SymmetryPlane> planes = findSymmetryPlanes(samples, kPlanes);
  const std::vector<PoseCandidate> poses = searchPoses(samples, planes, kCandidates);
  if (poses.empty()) throw InputError("looked for a plane of symmetry with a head on it and found none");

  std::vector<FaceMatch> matches;
  std::vector<std::size_t> order;
  for (const PoseCandidate& pose : poses) matches.push_back(glanceAtFace(surface, pose.frame));
  for (std::size_t i = 0; i < matches.size(); ++i) order.push_back(i);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return matches[a].mean() > matches[b].mean(); });

  // The few best are studied: a candidate that lies a little off may be the better face.
  FaceMatch best;
  std::size_t best_pose = 0;
  std::vector<FaceMatch> others;
  constexpr std::size_t kStudied = 3;
  for (std::size_t k = 0; k < std::min(kStudied, order.size()); ++k) {
    FaceMatch match = studyFace(surface, poses[order[k]].frame);
    if (k == 0 || match.mean() > best.mean()) {
      if (k > 0) others.push_back(std::move(best));
      best = std::move(match);
      best_pose = order[k];
    } else {
      others.push_back(std::move(match));
    }
  }

  // The plane of the face alone, whatever the rest of the mesh does.
  double error = 0;
  SymmetryPlane plane = planes[poses[best_pose].plane];
  if (plane.normal.dot(best.frame.mesh_from_head.col(0)) < 0)
    plane.normal = -plane.normal, plane.offset = -plane.offset;
  plane = refineSymmetryPlane(samples, plane, best.frame.toMesh({0, -0.4, -0.5}), 1.8 * best.frame.size, &error);
  FaceFrame frame = best.frame;
  frame.mesh_from_head =
      Eigen::Quaterniond::FromTwoVectors(frame.mesh_from_head.col(0), plane.normal) * frame.mesh_from_head;
  frame.origin -= (plane.normal.dot(frame.origin) - plane.offset) * plane.normal;
  const FaceMatch turned = studyFace(surface, frame);
  if (turned.mean() > best.mean() - 0.02) best = turned;

  FoundFace found;
  found.confidence = confidenceOf(best);
  if (found.confidence < options.min_confidence)
    throw InputError("looked for a face: " + std::to_string(planes.size()) + " planes of symmetry (the best mirrors " +
                     number(100 * planes.front().score, "%.0f") + " % of the surface) and " +
                     std::to_string(poses.size()) +
                     " ways to lie on them, and found no relief of eyes, nose and mouth (likeness to a face " +
                     number(best.mean(), "%.2f") + " of 1, needed about 0.6); give landmarks if this is a head");
  for (const FaceMatch& other : others)
    if (!sameFace(other.frame, best.frame) && other.mean() > best.mean() - 0.12)
      throw InputError("looked for one face and found two, " +
                       number((other.frame.origin - best.frame.origin).norm() * surface.size, "%.3g") +
                       " apart; keep one head in the file");

  found.mesh_from_head = best.frame.mesh_from_head;
  found.origin = surface.centre + surface.size * best.frame.origin;
  found.eye_separation = surface.size * best.frame.size;
  found.symmetry_normal = found.mesh_from_head.col(0);
  found.symmetry_offset = found.symmetry_normal.dot(found.origin);
  found.symmetry_error = error / best.frame.size;
  found.landmarks = landmarksOf(best, surface, found.confidence);

  Winding winding = findReversedPolygons(mesh, samples, best.frame);
  found.inside_out = winding.face_reversed;
  found.reversed_polygons = std::move(winding.reversed);
  if (!found.reversed_polygons.empty())
    found.notes.push_back(
        found.inside_out
            ? "the mesh is inside out, or mirrored by a left-handed program: its polygons run clockwise"
            : std::to_string(found.reversed_polygons.size()) + " polygons run clockwise seen from outside");
  if (found.symmetry_error > 0.06) found.notes.push_back("left and right of the face differ much");
  if (found.confidence < 0.7) found.notes.push_back("this may not be a face, or not a human one");
  return found;
}

}  // namespace volto::rig
