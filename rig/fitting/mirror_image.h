// Is the face its own mirror image? Most that are modelled are, and then what is known of one side is known of the
// other.
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "rig/feature_points.h"
#include "rig/fitting/landmark_checks.h"
#include "rig/fitting/target_surface.h"

namespace volto::rig {

struct MirrorPlane {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitX();  // unit
  double offset = 0;                                  // {p : normal . p = offset}

  Eigen::Vector3d mirrored(const Eigen::Vector3d& p) const { return p - 2 * (normal.dot(p) - offset) * normal; }
  Eigen::Vector3d mirroredDirection(const Eigen::Vector3d& d) const { return d - 2 * normal.dot(d) * normal; }
};

// The plane that the surface within `radius` of `centre` is its own mirror image in, to a few thousandths of the eye
// separation nearly everywhere; nothing where it is not. Sought near x = 0 by iterative closest points. Generic head's
// frame and unit (eye separations). Some milliseconds.
std::optional<MirrorPlane> findMirrorPlane(const TargetSurface& surface, const Eigen::Vector3d& centre, double radius);

// The nearest point of the line in which the plane cuts the surface, where its normal n has n . normal > 0; triangle
// -1: none.
SurfaceHit findOnPlane(const TargetSurface& surface, const MirrorPlane& plane, const Eigen::Vector3d& p,
                       const Eigen::Vector3d& normal);

// `landmarks` gain the mirror images of those whose partner is not among them.
void addMirrorImages(const MirrorPlane& plane, const Similarity& mesh_from_generic,
                     std::vector<PlacedLandmark>& landmarks);

// Where the 84 points lie, and which way the face looks there.
struct FacePoints {
  FeaturePointPositions positions, normals;
};
// Each in the middle of what the two sides say, or, where a person gave one of the two, where that one's mirror image
// is.
FacePoints alikeOnBothSides(const FacePoints& points, const MirrorPlane& plane, const Similarity& mesh_from_generic,
                            const std::vector<PlacedLandmark>& landmarks);

}  // namespace volto::rig
