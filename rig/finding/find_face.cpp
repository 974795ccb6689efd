#include "rig/finding/find_face.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <optional>
#include <string_view>

#include <Eigen/Geometry>

#include "rig/finding/face_search.h"
#include "rig/finding/winding.h"
#include "rig/head_frame.h"

namespace volto::rig {
namespace {

constexpr std::size_t kSamples = 8000;
// A ball that holds a head, in its own frame.
const Eigen::Vector3d kHeadCentre(0, -0.2, -1);
constexpr double kHeadRadius = 2.6;

// Those that a face's relief shows well; the corners of the eyes first. `shift`: the relief carries the generic head's
// point to one place and people mark another, so much farther to the left (mirrored on the right side) and up, in eye
// separations. Measured on ICT-FaceKit's generic head and MakeHuman's young woman (tests/rig/finding_test.cpp).
struct Landmark {
  std::string_view id;
  std::array<double, 2> shift{};
};
constexpr Landmark kLandmarks[] = {
    {"3.7", {-0.04, 0.1}},
    {"3.11", {-0.01, 0.065}},
    {"3.8", {0.01, 0.065}},
    {"3.12", {0.04, 0.1}},
    {"12.13", {0, 0.05}},
    {"9.3"},
    {"9.15", {0, -0.04}},
    {"9.1", {-0.055, -0.055}},
    {"9.2", {0.055, -0.055}},
    {"8.3"},
    {"8.4"},
    {"8.1"},
    {"8.2"},
    {"2.10"},
};

std::string number(double value, const char* format) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), format, value);
  return text.data();
}

// Half sure at a likeness that nothing has been seen with: people's faces lie above, what is no face below.
double confidenceOf(const FaceMatch& match) { return 1 / (1 + std::exp(-(match.likeness - 0.66) / 0.035)); }

void checkMesh(const Mesh& mesh, const FindOptions& options) {
  if (mesh.polygonCount() == 0) throw InputError("looked for a face and found no polygons");
  if (mesh.vertexCount() > options.max_vertices)
    throw InputError("the mesh has " + std::to_string(mesh.vertexCount()) +
                     " vertices; a face is looked for on up to " + std::to_string(options.max_vertices) +
                     ": decimate it, or give landmarks");
}

// What lies outside the head that has been found, if that is much.
std::vector<SurfaceSample> besides(const std::vector<SurfaceSample>& samples, const FaceFrame& frame) {
  std::vector<SurfaceSample> rest;
  for (const SurfaceSample& s : samples)
    if (frame.toHead(s.position).norm() > 0 && (frame.toHead(s.position) - kHeadCentre).norm() > kHeadRadius)
      rest.push_back(s);
  if (rest.size() < samples.size() / 6) rest.clear();
  return rest;
}

// How far away another face is, in this one's eye separations.
std::optional<double> faceBeside(const NormalisedSurface& surface, const std::vector<SurfaceSample>& samples,
                                 const FaceFrame& face) {
  const std::vector<SurfaceSample> rest = besides(samples, face);
  if (rest.empty()) return std::nullopt;
  const SearchResult other = searchFace(surface, rest, false);
  if (other.best.likeness < kFaceLikeness) return std::nullopt;
  return (other.best.frame.origin - face.origin).norm() / face.size;
}

// Behind a socket without its eyeball the relief is deep: a landmark that comes out far behind where the others have it
// is taken from the generic face.
void liftOutOfHoles(const std::vector<Eigen::Vector3d>& generic, std::vector<Eigen::Vector3d>& places) {
  constexpr double kTooDeep = 0.2;  // eye separations
  std::vector<double> behind;
  for (std::size_t i = 0; i < places.size(); ++i) behind.push_back(places[i].z() - generic[i].z());
  std::vector<double> sorted = behind;
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  for (std::size_t i = 0; i < places.size(); ++i)
    if (behind[i] < *middle - kTooDeep) places[i].z() = generic[i].z() + *middle;
}

std::vector<RoughLandmark> landmarksOf(const FaceMatch& match, const NormalisedSurface& surface, double confidence) {
  std::vector<RoughLandmark> landmarks;
  std::vector<Eigen::Vector2d> generic;
  std::vector<Eigen::Vector3d> generic_places, places;
  for (const auto& [id, shift] : kLandmarks) {
    const std::size_t point = *featurePointIndex(id);
    generic.push_back(faceTemplate().landmarks.row(static_cast<Eigen::Index>(point)).head<2>());
    const Eigen::Vector2d p = match.flow.carry(generic.back()) + Eigen::Vector2d(shift[0], shift[1]);
    const Eigen::Vector2d at = Relief::pixelsOf(p.x(), p.y(), match.relief.pixel);
    const double z = match.relief.depth.sample(static_cast<float>(at.x()), static_cast<float>(at.y()));
    generic_places.emplace_back(faceTemplate().landmarks.row(static_cast<Eigen::Index>(point)));
    places.emplace_back(p.x(), p.y(), z);
    landmarks.push_back({point, Eigen::Vector3d::Zero(), 0});
  }
  liftOutOfHoles(generic_places, places);
  for (std::size_t i = 0; i < places.size(); ++i)
    landmarks[i].position = surface.centre + surface.size * match.frame.toMesh(places[i]);
  const std::vector<double> likeness = likenessAround(match, generic, 0.2);
  for (std::size_t i = 0; i < landmarks.size(); ++i) landmarks[i].confidence = confidence * likeness[i];
  return landmarks;
}

}  // namespace

std::optional<double> findAnotherFace(const Mesh& mesh, const FeaturePointPositions& points) {
  checkMesh(mesh, {});
  const NormalisedSurface surface = normaliseSurface(mesh);
  const auto at = [&](std::string_view id) -> Eigen::Vector3d {
    return (points.row(static_cast<Eigen::Index>(*featurePointIndex(id))).transpose() - surface.centre) / surface.size;
  };
  const Eigen::Vector3d left = (at("3.7") + at("3.11")) / 2, right = (at("3.8") + at("3.12")) / 2;
  const FaceFrame face{meshFromHead(points), (left + right) / 2, (left - right).norm()};
  // What is nowhere far from the face needs no looking at.
  const Eigen::RowVector3d centre = face.toMesh(kHeadCentre).transpose();
  if ((surface.positions.rowwise() - centre).rowwise().norm().maxCoeff() < kHeadRadius * face.size) return std::nullopt;
  return faceBeside(surface, sampleVisibleSurface(surface, kSamples), face);
}

FoundFace findFace(const Mesh& mesh, const FindOptions& options) {
  checkMesh(mesh, options);
  const NormalisedSurface surface = normaliseSurface(mesh);
  std::vector<std::uint32_t> hidden;
  const std::vector<SurfaceSample> samples = sampleVisibleSurface(surface, kSamples, &hidden);
  if (samples.size() < 100)
    throw InputError("looked for a face and found next to no surface that is seen from outside");
  const SearchResult search = searchFace(surface, samples, true);
  const FaceMatch& best = search.best;

  FoundFace found;
  found.confidence = search.poses == 0 ? 0 : confidenceOf(best);
  if (search.poses == 0 || found.confidence < options.min_confidence)
    throw InputError("looked for a face on " + std::to_string(search.planes) +
                     " planes of symmetry (the best mirrors " + number(100 * search.best_mirrored, "%.0f") +
                     " % of the surface), " + std::to_string(search.poses) +
                     " ways to lie on them, and found no eyes, nose and mouth (likeness " +
                     number(std::max(0.0, best.likeness), "%.2f") + ", a face has " + number(kFaceLikeness, "%.1f") +
                     " or more); if this is a head, give landmarks");
  if (const std::optional<double> apart = faceBeside(surface, samples, best.frame))
    throw InputError("looked for one face and found two, " + number(*apart, "%.1f") +
                     " eye separations apart; keep one head in the file");

  found.mesh_from_head = best.frame.mesh_from_head;
  found.landmarks = landmarksOf(best, surface, found.confidence);
  const Eigen::Vector3d left_eye = (found.landmarks[0].position + found.landmarks[1].position) / 2;
  const Eigen::Vector3d right_eye = (found.landmarks[2].position + found.landmarks[3].position) / 2;
  found.origin = (left_eye + right_eye) / 2;
  found.eye_separation = (left_eye - right_eye).norm();
  found.symmetry_normal = found.mesh_from_head.col(0);
  found.symmetry_offset = found.symmetry_normal.dot(found.origin);
  found.symmetry_error = surface.size * search.symmetry_error / found.eye_separation;

  Winding winding = findReversedPolygons(mesh, samples, hidden, best.frame);
  found.inside_out = winding.face_reversed;
  found.reversed_polygons = std::move(winding.reversed);
  if (found.inside_out)
    found.notes.push_back("the mesh is inside out, or mirrored by a left-handed program: its polygons run clockwise");
  else if (!found.reversed_polygons.empty())
    found.notes.push_back(std::to_string(found.reversed_polygons.size()) + " polygons run clockwise seen from outside");
  if (found.symmetry_error > 0.06) found.notes.push_back("left and right of the face differ much");
  if (found.confidence < 0.75) found.notes.push_back("this may not be a face, or not a human one: check the points");
  return found;
}

}  // namespace volto::rig
