#include "tools/cli/expression_report.h"

#include <algorithm>
#include <cstdio>

#include <nlohmann/json.hpp>

#include "retarget/expression_health.h"
#include "tools/cli/tracking_flags.h"
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
                       {"flipped_skin", pose.flipped_skin},
                       {"degenerate", pose.degenerate},
                       {"eyeball_depth_es", pose.eyeball_depth_es},
                       {"lids_depth_es", pose.lids_depth_es},
                       {"lips_depth_es", pose.lips_depth_es}});
    }
  }
  return {{"poses", health.shapes.size() + health.combinations.size()},
          {"triangles", health.triangles},
          {"flipped", health.flipped()},
          {"flipped_skin", health.flippedSkin()},
          {"degenerate", health.degenerate()},
          {"eyeball_depth_es", worst.eyeball_depth_es},
          {"lids_depth_es", worst.lids_depth_es},
          {"lips_depth_es", worst.lips_depth_es},
          {"blink_gap_es", health.blink_gap_es},
          {"symmetry_es", health.symmetry_es},
          {"border_es", health.border_es},
          {"worst", std::move(poses)}};
}

Json performanceReport(const rig::Rig& rig, const std::string& path) {
  const pipeline::Performance performance = readPerformanceFor("inspect", path);
  pipeline::FramePath frames(rig, trackingOptions(TrackingFlags{}, performance), {.mesh = true, .weights = true});
  retarget::HealthMeasure measure(rig);
  retarget::PoseHealth sum, worst;
  std::size_t with_flips = 0, worst_frame = 0;
  double worst_depth = 0;
  for (std::size_t frame = 0; frame < performance.frameCount(); ++frame) {
    frames.push(performance, frame);
    const retarget::PoseHealth pose = measure.measure("", frames.avatar().vertices);
    sum.flipped += pose.flipped;
    sum.degenerate += pose.degenerate;
    with_flips += pose.flipped > 0 ? 1 : 0;
    const double depth = std::max({pose.eyeball_depth_es, pose.lids_depth_es, pose.lips_depth_es});
    if (pose.flipped > worst.flipped || (pose.flipped == worst.flipped && depth > worst_depth)) worst_frame = frame;
    worst_depth = std::max(worst_depth, depth);
    worst.flipped = std::max(worst.flipped, pose.flipped);
    worst.eyeball_depth_es = std::max(worst.eyeball_depth_es, pose.eyeball_depth_es);
    worst.lids_depth_es = std::max(worst.lids_depth_es, pose.lids_depth_es);
    worst.lips_depth_es = std::max(worst.lips_depth_es, pose.lips_depth_es);
  }
  return {{"frames", performance.frameCount()},
          {"flipped", sum.flipped},
          {"frames_with_flips", with_flips},
          {"degenerate", sum.degenerate},
          {"eyeball_depth_es", worst.eyeball_depth_es},
          {"lids_depth_es", worst.lids_depth_es},
          {"lips_depth_es", worst.lips_depth_es},
          {"worst_frame", worst_frame}};
}

std::string performanceInWords(const Json& report) {
  char line[300];
  std::snprintf(line, sizeof line,
                "performance: %zu frames; %zu triangles turn over in %zu of them, %zu degenerate; deepest, in %% of the "
                "eye separation: eyeball %.2f, lids %.2f, lips %.2f\n",
                report["frames"].get<std::size_t>(), report["flipped"].get<std::size_t>(),
                report["frames_with_flips"].get<std::size_t>(), report["degenerate"].get<std::size_t>(),
                100 * report["eyeball_depth_es"].get<double>(), 100 * report["lids_depth_es"].get<double>(),
                100 * report["lips_depth_es"].get<double>());
  return line;
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
