// Where a set of expressions is wrong, in colour on the face.
#pragma once

#include <span>

#include "rig/mesh.h"
#include "tools/picture/picture.h"
#include "transfer/evaluation.h"

namespace volto::cli {

// A sheet: the neutral face coloured by the error over all expressions, then the expressions with the largest relative
// error, each in its own shape with its own error. One scale of colour for all: dark blue 0, white half, red
// `full_scale` and more (mesh unit).
picture::Picture errorSheet(const rig::Mesh& neutral, const rig::VertexPositions& truth_neutral,
                            const transfer::Evaluation& evaluation, std::span<const rig::VertexPositions> results,
                            std::span<const rig::VertexPositions> truths, double full_scale,
                            const Eigen::Matrix3d& mesh_from_head);

}  // namespace volto::cli
