#include "tools/cli/expression_report.h"

#include <nlohmann/json.hpp>

#include "retarget/expression_health.h"
#include "tools/picture/png.h"
#include "tools/picture/shape_sheet.h"

namespace volto::cli {

Json expressionReport(const rig::Rig& rig) {
  const retarget::ExpressionHealth health = retarget::measureExpressions(rig);
  const retarget::PoseHealth worst = health.worst();
  Json poses = Json::array();
  for (const auto* list : {&health.shapes, &health.combinations}) {
    for (const retarget::PoseHealth& pose : *list) {
      if (pose.flipped + pose.degenerate == 0 && pose.eyeball_depth_es < 5e-3 && pose.lids_depth_es < 5e-3 &&
          pose.lips_depth_es < 5e-3)
        continue;
      poses.push_back({{"name", pose.name},
                       {"flipped", pose.flipped},
                       {"degenerate", pose.degenerate},
                       {"eyeball_depth_es", pose.eyeball_depth_es},
                       {"lids_depth_es", pose.lids_depth_es},
                       {"lips_depth_es", pose.lips_depth_es}});
    }
  }
  return {{"poses", health.shapes.size() + health.combinations.size()},
          {"triangles", health.triangles},
          {"flipped", health.flipped()},
          {"degenerate", health.degenerate()},
          {"eyeball_depth_es", worst.eyeball_depth_es},
          {"lids_depth_es", worst.lids_depth_es},
          {"lips_depth_es", worst.lips_depth_es},
          {"blink_gap_es", health.blink_gap_es},
          {"symmetry_es", health.symmetry_es},
          {"border_es", health.border_es},
          {"worst", std::move(poses)}};
}

void writeShapeSheet(const std::string& path, const rig::Rig& rig, int cell_px) {
  picture::ShapeSheetOptions options;
  options.cell_px = cell_px;
  picture::writePng(path, picture::shapeSheet(rig, options));
}

void writeCombinationSheet(const std::string& path, const rig::Rig& rig, int cell_px) {
  picture::ShapeSheetOptions options;
  options.cell_px = cell_px;
  options.columns = 4;
  picture::writePng(path, picture::poseSheet(rig, rig::combinedExpressions(), options));
}

}  // namespace volto::cli
