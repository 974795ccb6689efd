#include "tools/picture/mask_overlay.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "rig/control_mask.h"
#include "tools/picture/text.h"

namespace volto::picture {
namespace {

Vec3 rowOf(const rig::FeaturePointPositions& positions, std::size_t i) {
  const auto row = positions.row(static_cast<Eigen::Index>(i));
  return {static_cast<float>(row.x()), static_cast<float>(row.y()), static_cast<float>(row.z())};
}

bool inFront(const Camera::Point& p) { return std::isfinite(p.x_px) && std::isfinite(p.y_px) && p.depth > 0.0F; }

// How strongly a point is drawn: by whether the head hides it.
float coverOf(const Rendered& rendered, const Camera::Point& p, const OverlayStyle& style) {
  if (!(std::abs(p.x_px) < 1e6F && std::abs(p.y_px) < 1e6F)) return 0.0F;
  const int x = static_cast<int>(std::floor(p.x_px)), y = static_cast<int>(std::floor(p.y_px));
  if (x < 0 || y < 0 || x >= rendered.picture.width || y >= rendered.picture.height) return 1.0F;
  const float surface = rendered.depth[static_cast<std::size_t>(y) * static_cast<std::size_t>(rendered.picture.width) +
                                       static_cast<std::size_t>(x)];
  return p.depth <= surface + style.depth_slack * p.depth ? 1.0F : style.hidden_cover;
}

// In short pieces, so that a line that goes behind something fades there.
void drawEdge(Rendered& rendered, Vec3 a, Vec3 b, const OverlayStyle& style) {
  const Camera::Point from = rendered.camera.project(a), to = rendered.camera.project(b);
  if (!inFront(from) || !inFront(to)) return;
  const float pixels = std::hypot(to.x_px - from.x_px, to.y_px - from.y_px);
  const int pieces = std::clamp(static_cast<int>(pixels / 6.0F), 1, 64);
  Camera::Point last = from;
  for (int k = 1; k <= pieces; ++k) {
    const Camera::Point next = rendered.camera.project(mix(a, b, static_cast<float>(k) / static_cast<float>(pieces)));
    const Camera::Point middle{0.5F * (last.x_px + next.x_px), 0.5F * (last.y_px + next.y_px),
                               0.5F * (last.depth + next.depth)};
    drawLine(rendered.picture, last.x_px, last.y_px, next.x_px, next.y_px, style.line, style.line_px,
             0.8F * coverOf(rendered, middle, style));
    last = next;
  }
}

void drawPoint(Rendered& rendered, Vec3 p, std::string_view label, const OverlayStyle& style) {
  const Camera::Point at = rendered.camera.project(p);
  if (!inFront(at)) return;
  const float cover = coverOf(rendered, at, style);
  drawDisc(rendered.picture, at.x_px, at.y_px, style.point_px + 0.8F, {20, 22, 26}, 0.6F * cover);
  drawDisc(rendered.picture, at.x_px, at.y_px, style.point_px, style.point, cover);
  if (style.labels && cover > 0.5F) {
    drawText(rendered.picture, at.x_px + style.point_px + 2.0F, at.y_px - 2.0F, label, {7.0F, {255, 255, 255}});
  }
}

}  // namespace

void drawMask(Rendered& rendered, const rig::FeaturePointPositions& positions, const OverlayStyle& style) {
  std::set<std::pair<std::uint8_t, std::uint8_t>> edges;
  for (const rig::MaskTriangle& triangle : rig::maskTriangles()) {
    for (std::size_t k = 0; k < 3; ++k) edges.insert(std::minmax(triangle[k], triangle[(k + 1) % 3]));
  }
  for (const auto& [a, b] : edges) drawEdge(rendered, rowOf(positions, a), rowOf(positions, b), style);
  for (std::size_t i = 0; i < kFeaturePointCount; ++i)
    drawPoint(rendered, rowOf(positions, i), rig::featurePoints()[i].id, style);
}

void drawPoints(Rendered& rendered, std::span<const Vec3> points, const OverlayStyle& style) {
  for (std::size_t i = 0; i < points.size(); ++i) drawPoint(rendered, points[i], std::to_string(i), style);
}

void drawWireframe(Rendered& rendered, const rig::Mesh& mesh, const rig::VertexPositions& positions,
                   const OverlayStyle& style) {
  OverlayStyle thin = style;
  thin.hidden_cover = 0.0F;
  const auto vertex = [&](std::uint32_t v) {
    return Vec3{static_cast<float>(positions(v, 0)), static_cast<float>(positions(v, 1)),
                static_cast<float>(positions(v, 2))};
  };
  std::set<std::pair<std::uint32_t, std::uint32_t>> edges;
  for (std::size_t p = 0; p < mesh.polygonCount(); ++p) {
    const std::uint32_t begin = mesh.polygon_start[p], end = mesh.polygon_start[p + 1];
    for (std::uint32_t c = begin; c < end; ++c) {
      edges.insert(std::minmax(mesh.corner_vertices[c], mesh.corner_vertices[c + 1 < end ? c + 1 : begin]));
    }
  }
  for (const auto& [a, b] : edges) {
    if (static_cast<Eigen::Index>(b) < positions.rows()) drawEdge(rendered, vertex(a), vertex(b), thin);
  }
}

}  // namespace volto::picture
