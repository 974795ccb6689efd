#include "tools/cli/error_picture.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <numeric>
#include <string>

#include "tools/picture/contact_sheet.h"
#include "tools/picture/head_renderer.h"

namespace volto::cli {
namespace {

constexpr int kCellPx = 400;
constexpr std::size_t kColumns = 4;
constexpr std::size_t kWorst = 11;

picture::Vec3 colourOf(double error, double full_scale) {
  // Dark blue, light blue, pale, orange, red: ordered in lightness up to the middle, so that it reads in grey too.
  constexpr std::array<picture::Vec3, 5> kStops = {{{0.03F, 0.06F, 0.25F},
                                                    {0.10F, 0.40F, 0.75F},
                                                    {0.80F, 0.80F, 0.72F},
                                                    {0.85F, 0.35F, 0.05F},
                                                    {0.45F, 0.01F, 0.02F}}};
  const double x = std::clamp(error / full_scale, 0.0, 1.0) * (kStops.size() - 1);
  const auto i = std::min<std::size_t>(static_cast<std::size_t>(x), kStops.size() - 2);
  const auto f = static_cast<float>(x - static_cast<double>(i));
  return {kStops[i].x + f * (kStops[i + 1].x - kStops[i].x), kStops[i].y + f * (kStops[i + 1].y - kStops[i].y),
          kStops[i].z + f * (kStops[i + 1].z - kStops[i].z)};
}

picture::Look errorLook(const rig::Mesh& mesh, std::span<const float> error, double full_scale) {
  picture::Look look;
  picture::Surface matt;
  matt.name = "error";
  matt.albedo = {1, 1, 1};
  matt.specular = 0.01F;
  look.surfaces.push_back(matt);
  look.polygon_surface.assign(mesh.polygonCount(), 0);
  for (const float e : error) look.vertex_tint.push_back(colourOf(static_cast<double>(e), full_scale));
  return look;
}

picture::ViewOptions viewOf(const Eigen::Matrix3d& mesh_from_head) {
  picture::ViewOptions view = picture::frontView(kCellPx);
  view.lighting = picture::Lighting::frontal;
  const auto column = [&](int i) {
    return picture::Vec3{static_cast<float>(mesh_from_head(0, i)), static_cast<float>(mesh_from_head(1, i)),
                         static_cast<float>(mesh_from_head(2, i))};
  };
  view.head_from_mesh = {column(0), column(1), column(2)};
  return view;
}

}  // namespace

picture::Picture errorSheet(const rig::Mesh& neutral, const rig::VertexPositions& truth_neutral,
                            const transfer::Evaluation& evaluation, std::span<const rig::VertexPositions> results,
                            std::span<const rig::VertexPositions> truths, double full_scale,
                            const Eigen::Matrix3d& mesh_from_head) {
  std::vector<std::size_t> order(evaluation.expressions.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto relative = [&](std::size_t i) { return evaluation.expressions[i].whole.relative.value_or(0); };
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return relative(a) > relative(b); });
  order.resize(std::min(order.size(), kWorst));

  const picture::ViewOptions view = viewOf(mesh_from_head);
  std::vector<picture::Cell> cells;
  picture::HeadRenderer mean(neutral, errorLook(neutral, evaluation.rms_per_vertex, full_scale));
  cells.push_back({mean.render(neutral.positions, view).picture, "all expressions"});
  for (const std::size_t i : order) {
    const rig::VertexPositions expected = neutral.positions + (truths[i] - truth_neutral);
    std::vector<float> error(neutral.vertexCount(), 0.0F);
    for (std::size_t v = 0; v < error.size(); ++v) {
      const auto row = static_cast<Eigen::Index>(v);
      if (evaluation.rms_per_vertex[v] > 0)
        error[v] = static_cast<float>((results[i].row(row) - expected.row(row)).norm());
    }
    picture::HeadRenderer renderer(neutral, errorLook(neutral, error, full_scale));
    char caption[96];
    std::snprintf(caption, sizeof caption, "%.60s %.3f", evaluation.expressions[i].name.c_str(), relative(i));
    cells.push_back({renderer.render(results[i], view).picture, caption});
  }
  picture::SheetStyle style;
  char title[96];
  std::snprintf(title, sizeof title, "error: dark blue 0, pale %.3g, red %.3g and more (mesh unit)", full_scale / 2,
                full_scale);
  style.title = title;
  return picture::contactSheet(cells, std::min(kColumns, cells.size()), style);
}

}  // namespace volto::cli
