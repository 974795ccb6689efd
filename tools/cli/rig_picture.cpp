#include "tools/cli/rig_picture.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <system_error>
#include <vector>

#include "retarget/expression_health.h"
#include "retarget/face_deformer.h"
#include "rig/rig_health.h"
#include "tools/cli/exit_status.h"
#include "tools/picture/contact_sheet.h"
#include "tools/picture/mask_overlay.h"
#include "tools/picture/png.h"
#include "tools/picture/rig_look.h"

namespace volto::cli {

namespace {

constexpr int kCell_px = 460;
using Positions = std::vector<std::array<float, 3>>;

picture::ViewOptions viewOf(const rig::Rig& rig, float yaw_deg) {
  picture::ViewOptions view = picture::frontView(kCell_px);
  view.yaw_deg = yaw_deg;
  const auto row = [&rig](Eigen::Index axis) {
    const Eigen::Vector3d v = rig.mesh_from_head.col(axis);
    return picture::Vec3{static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])};
  };
  view.head_from_mesh = {row(0), row(1), row(2)};
  return view;
}

// Every triangle of the mask in a colour that its neighbours have not; what follows nothing is grey, parts are darker.
picture::Look regionLook(const rig::Rig& rig) {
  picture::Look look = picture::lookOf(rig.neutral);
  for (picture::Surface& surface : look.surfaces) {
    surface.albedo = {0.62F, 0.62F, 0.62F};
    surface.specular = 0.01F;
    surface.softness = 0;
    surface.eyeball = -1;
    surface.drawn = true;
  }
  look.eyeballs.clear();
  const auto triangles = rig::maskTriangles();
  std::vector<int> colour(triangles.size(), -1);
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    std::vector<bool> taken(12, false);
    for (std::size_t u = 0; u < t; ++u)
      for (const auto p : triangles[t])
        if (std::find(triangles[u].begin(), triangles[u].end(), p) != triangles[u].end())
          taken[static_cast<std::size_t>(colour[u])] = true;
    colour[t] = static_cast<int>(std::find(taken.begin(), taken.end() - 1, false) - taken.begin());
  }
  look.vertex_tint.assign(rig.neutral.vertexCount(), {0.45F, 0.45F, 0.45F});
  for (std::size_t v = 0; v < look.vertex_tint.size(); ++v) {
    const std::int16_t t = rig.association.triangle[v];
    if (t < 0) continue;
    const picture::Colour c = picture::distinctColour(colour[static_cast<std::size_t>(t)]);
    const float shade = rig.association.kind[v] == rig::AssociationKind::ray ? 1.0F : 0.45F;
    const auto linear = [shade](std::uint8_t s) { return shade * std::pow(static_cast<float>(s) / 255.0F, 2.2F); };
    look.vertex_tint[v] = {linear(c.r), linear(c.g), linear(c.b)};
  }
  return look;
}

}  // namespace

void writeRigPicture(const std::filesystem::path& path, const rig::Rig& rig) {
  const std::vector<picture::Vec3> face = picture::facePoints(rig);
  const rig::RigHealth health = rig::inspectRig(rig);
  std::vector<picture::Cell> cells;

  picture::HeadRenderer looks(rig.neutral, picture::lookOfRig(rig));
  looks.focusOn(face);
  for (const float yaw : {0.0F, -40.0F}) {
    picture::Rendered rendered = looks.render(viewOf(rig, yaw));
    picture::drawMask(rendered, rig.feature_positions);
    cells.push_back({std::move(rendered.picture), yaw == 0 ? "the mask, 84 points" : "the mask from the side"});
  }

  picture::HeadRenderer regions(rig.neutral, regionLook(rig));
  regions.focusOn(face);
  std::vector<picture::Vec3> marked;
  for (const auto* list : {&health.torn, &health.doubtful})
    for (const std::uint32_t v : *list)
      marked.push_back({static_cast<float>(rig.neutral.positions(v, 0)),
                        static_cast<float>(rig.neutral.positions(v, 1)),
                        static_cast<float>(rig.neutral.positions(v, 2))});
  for (const float yaw : {0.0F, -40.0F}) {
    picture::Rendered rendered = regions.render(viewOf(rig, yaw));
    picture::OverlayStyle style;
    style.point = {255, 40, 40};
    style.point_px = 2.0F;
    picture::drawPoints(rendered, marked, style);
    if (yaw != 0 && !rig.refined.empty()) {
      std::vector<picture::Vec3> added;
      for (Eigen::Index p = static_cast<Eigen::Index>(kFeaturePointCount); p < rig.refined.positions.rows(); ++p)
        added.push_back({static_cast<float>(rig.refined.positions(p, 0)),
                         static_cast<float>(rig.refined.positions(p, 1)),
                         static_cast<float>(rig.refined.positions(p, 2))});
      style.point = {255, 255, 255};
      style.point_px = 1.4F;
      picture::drawPoints(rendered, added, style);
    }
    const std::string added = rig.refined.empty() ? "dark: by the way along the skin"
                                                  : std::to_string(rig.refined.pointCount() - kFeaturePointCount) +
                                                        " points from subdivision, white";
    cells.push_back({std::move(rendered.picture),
                     yaw == 0 ? "regions; doubtful vertices red: " + std::to_string(marked.size()) : added});
  }

  // The expressions that turn most triangles over; where none does, the two that move most.
  const retarget::ExpressionHealth expressions = retarget::measureExpressions(rig);
  const retarget::FaceDeformer deformer(rig);
  std::vector<std::pair<double, std::size_t>> order;
  Positions moved(rig.neutral.vertexCount());
  for (std::size_t k = 0; k < rig.blendshapes.size() && k < expressions.shapes.size(); ++k) {
    double motion = 0;
    for (const auto& d : rig.blendshapes[k].mask_displacement) motion += std::hypot(d[0], d[1], d[2]);
    const double size = std::max(rig.fapu.fapu.eye_separation, 1e-30);
    order.emplace_back(static_cast<double>(expressions.shapes[k].flipped) + motion / size / 100, k);
  }
  std::sort(order.begin(), order.end(), [](const auto& a, const auto& b) { return a > b; });
  for (std::size_t i = 0; i < std::min<std::size_t>(2, order.size()); ++i) {
    const std::size_t k = order[i].second;
    std::vector<float> weights(rig.blendshapes.size(), 0.0F);
    weights[k] = 1;
    deformer.deformAtWeights(weights, moved);
    const std::size_t flipped = expressions.shapes[k].flipped;
    cells.push_back({looks.render(moved, viewOf(rig, i == 0 ? 0.0F : -30.0F)).picture,
                     rig.blendshapes[k].name + ": " + std::to_string(flipped) + " triangles turn over"});
  }

  picture::SheetStyle style;
  style.title = rig.name;
  try {
    picture::writePng(path, picture::contactSheet(cells, 3, style));
  } catch (const std::system_error& error) {
    throw CommandError(kFailed, error.what());
  }
}

}  // namespace volto::cli
