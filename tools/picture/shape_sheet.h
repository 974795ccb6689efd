// Contact sheets of a character: neutral from three sides and every blendshape, or a list of combined expressions. What
// is looked at before a character is believed.
#pragma once

#include <span>

#include "rig/combined_expressions.h"
#include "rig/rig.h"
#include "tools/picture/picture.h"

namespace volto::picture {

struct ShapeSheetOptions {
  int cell_px = 320;  // 64 .. 1024
  std::size_t columns = 8;
  float yaw_deg = 0.0F;     // how the shapes are seen; neutral is shown from front, three-quarter and side anyway
  bool whole_head = false;  // else the face fills the cell
};

// Neutral (front, three-quarter, side) and each blendshape at 1.
Picture shapeSheet(const rig::Rig& rig, const ShapeSheetOptions& options = {});

// Poses; those that name a shape which the rig has not are left out. Throws std::invalid_argument when none is left.
Picture poseSheet(const rig::Rig& rig, std::span<const rig::NamedPose> poses, const ShapeSheetOptions& options = {});

// One pose, at any size.
Picture posePicture(const rig::Rig& rig, const rig::NamedPose& pose, const ShapeSheetOptions& options = {});

}  // namespace volto::picture
