#include "tools/picture/shape_sheet.h"

#include <algorithm>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "retarget/face_deformer.h"
#include "tools/picture/contact_sheet.h"
#include "tools/picture/head_renderer.h"
#include "tools/picture/rig_look.h"

namespace volto::picture {
namespace {

class SheetMaker {
 public:
  SheetMaker(const rig::Rig& rig, const ShapeSheetOptions& options)
      : rig_(rig), options_(options), deformer_(rig), renderer_(rig.neutral, lookOfRig(rig)) {
    if (options.cell_px < 64 || options.cell_px > 1024) throw std::invalid_argument("cells are 64 to 1024 pixels");
    if (!options.whole_head) renderer_.focusOn(facePoints(rig));
    positions_.resize(rig.neutral.vertexCount());
  }

  std::optional<std::vector<float>> weightsOf(const rig::NamedPose& pose) const {
    std::vector<float> weights(rig_.blendshapes.size(), 0.0F);
    for (const auto& [name, weight] : pose.weights) {
      const auto found = std::find_if(rig_.blendshapes.begin(), rig_.blendshapes.end(),
                                      [&](const rig::Blendshape& b) { return b.name == name; });
      if (found == rig_.blendshapes.end()) return std::nullopt;
      weights[static_cast<std::size_t>(found - rig_.blendshapes.begin())] = weight;
    }
    return weights;
  }

  Picture picture(std::span<const float> weights, float yaw_deg) {
    deformer_.deformAtWeights(weights, positions_);
    ViewOptions view = frontView(options_.cell_px);
    view.yaw_deg = yaw_deg;
    const auto row = [&](Eigen::Index i) {
      const Eigen::Vector3f r = rig_.mesh_from_head.col(i).cast<float>();  // a row of the transpose
      return Vec3{r.x(), r.y(), r.z()};
    };
    view.head_from_mesh = {row(0), row(1), row(2)};
    return renderer_.render(positions_, view).picture;
  }

  Picture sheet(std::span<const Cell> cells) const {
    SheetStyle style;
    style.text_px = std::max(6.0F, static_cast<float>(options_.cell_px) / 32.0F);
    return contactSheet(cells, std::min(options_.columns, cells.size()), style);
  }

 private:
  const rig::Rig& rig_;
  ShapeSheetOptions options_;
  retarget::FaceDeformer deformer_;
  HeadRenderer renderer_;
  std::vector<retarget::Vertex> positions_;
};

}  // namespace

Picture shapeSheet(const rig::Rig& rig, const ShapeSheetOptions& options) {
  SheetMaker maker(rig, options);
  std::vector<float> weights(rig.blendshapes.size(), 0.0F);
  std::vector<Cell> cells;
  cells.push_back({maker.picture(weights, 0.0F), "neutral"});
  cells.push_back({maker.picture(weights, -35.0F), "three-quarter"});
  cells.push_back({maker.picture(weights, -90.0F), "side"});
  for (std::size_t k = 0; k < weights.size(); ++k) {
    weights[k] = 1.0F;
    cells.push_back({maker.picture(weights, options.yaw_deg), rig.blendshapes[k].name});
    weights[k] = 0.0F;
  }
  return maker.sheet(cells);
}

Picture poseSheet(const rig::Rig& rig, std::span<const rig::NamedPose> poses, const ShapeSheetOptions& options) {
  SheetMaker maker(rig, options);
  std::vector<Cell> cells;
  for (const rig::NamedPose& pose : poses) {
    if (const auto weights = maker.weightsOf(pose))
      cells.push_back({maker.picture(*weights, options.yaw_deg), pose.name});
  }
  if (cells.empty()) throw std::invalid_argument("the rig has not the shapes of any of these expressions");
  return maker.sheet(cells);
}

Picture posePicture(const rig::Rig& rig, const rig::NamedPose& pose, const ShapeSheetOptions& options) {
  SheetMaker maker(rig, options);
  const auto weights = maker.weightsOf(pose);
  if (!weights) throw std::invalid_argument("the rig has not the shapes of " + pose.name);
  return maker.picture(*weights, options.yaw_deg);
}

}  // namespace volto::picture
