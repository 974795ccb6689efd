// Whether landmarks can be those of a face, before anything is bent to them.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "rig/feature_points.h"
#include "rig/fitting/landmark_warp.h"

namespace volto::rig {

struct PlacedLandmark {
  std::size_t feature_point = 0;
  Eigen::Vector3d position;  // mesh frame
  Eigen::Vector3d normal;    // out of the surface there, mesh frame; zero: unknown
  double off_surface = 0;    // distance, mesh unit
  double sigma_es = 0;       // 0: given by a person
};

struct FacePlacement {
  Similarity mesh_from_generic;
  bool sides_exchanged = false;  // the landmarks were renamed, left for right: the mesh is a mirror image
  std::vector<std::string> notes;
};

// `generic`: the 84 points of the generic face, `generic_normals` out of it there. `inside_out`: the mesh's polygons
// run clockwise (the normals given are already turned outward): then exchanged sides come from mirrored geometry and
// are mended, with a note; otherwise they are the person's mistake. Throws InputError as fitPoints says.
FacePlacement placeFace(std::vector<PlacedLandmark>& landmarks, const FeaturePointPositions& generic,
                        const FeaturePointPositions& generic_normals, bool inside_out);

}  // namespace volto::rig
