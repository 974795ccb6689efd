// Where the face is on a mesh that nobody said anything about: which way it looks, how large it is, its plane of
// symmetry, and a dozen rough landmarks to start a fit from (rig/fitting).
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "rig/errors.h"
#include "rig/feature_points.h"
#include "rig/mesh.h"

namespace volto::rig {

struct FindOptions {
  std::size_t max_vertices = 5'000'000;  // a larger mesh is refused before anything is done
  double min_confidence = 0.35;          // a face less sure than this is refused; 0 takes the best guess there is
};

struct RoughLandmark {
  std::size_t feature_point = 0;  // index into featurePoints()
  Eigen::Vector3d position;       // mesh frame, on the surface or within a few hundredths of the eye separation of it
  double confidence = 0;          // 0..1; below 0.3: where a human face would have it, not seen on this mesh
};

struct FoundFace {
  // d_mesh = mesh_from_head * d_head; head frame: +x to the subject's left, +y up, +z out of the face; a rotation.
  Eigen::Matrix3d mesh_from_head;
  Eigen::Vector3d origin;     // between the centres of the eyes (an eye's centre: middle of its corners), mesh frame
  double eye_separation = 0;  // between those centres, mesh unit

  // The plane {p : symmetry_normal . p = symmetry_offset}; the normal is unit and points to the subject's left.
  Eigen::Vector3d symmetry_normal;
  double symmetry_offset = 0;
  double symmetry_error = 0;  // of the skin mirrored onto itself, root mean square, in eye separations

  std::vector<RoughLandmark> landmarks;  // 10 to 14, each feature point at most once, midline points among them
  double confidence = 0;                 // 0..1 that this is a face and lies as said

  // Polygons that run the wrong way round (seen from outside clockwise), ascending. All of them: the mesh is inside out
  // or comes from a left-handed program; which of the two a symmetric head cannot tell. See reversePolygons().
  std::vector<std::uint32_t> reversed_polygons;
  bool inside_out = false;  // the face's own polygons are among them

  std::vector<std::string> notes;  // what a person should know, one sentence each
};

// Looks at the surface alone: no names, no materials, no colours; the mesh may lie, be scaled and be placed anyhow, be
// open or closed, with or without eyeballs, teeth, hair, neck, shoulders. Only a face with some left-right symmetry is
// found. Deterministic, single-threaded; O(V) plus a search over some thousand sampled points.
// Throws InputError with what was looked for and not found: an empty or flat mesh, too many vertices, no plane of
// symmetry, no face, two faces.
FoundFace findFace(const Mesh& mesh, const FindOptions& options = {});

// Whether the mesh holds another face than the one that these points are on: how far away it is, in this one's eye
// separations. Looked for where at least a sixth of the surface is farther away than a head reaches; costs what findFace
// costs then, and next to nothing else. `points`: all 84, mesh frame.
std::optional<double> findAnotherFace(const Mesh& mesh, const FeaturePointPositions& points);

// Turns the corner order of these polygons round (texture coordinates with them), first corner kept.
void reversePolygons(Mesh& mesh, std::span<const std::uint32_t> polygons);

}  // namespace volto::rig
