#include "tools/picture/head_renderer.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <string>
#include <tuple>

#include "tools/picture/ambient_occlusion.h"
#include "tools/picture/shading.h"
#include "tools/picture/visibility.h"

namespace volto::picture {
namespace {

bool finite(Vec3 v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

Vec3 rowOf(const rig::VertexPositions& positions, Eigen::Index row) {
  return {static_cast<float>(positions(row, 0)), static_cast<float>(positions(row, 1)),
          static_cast<float>(positions(row, 2))};
}

constexpr int kShadowSize = 1024;

}  // namespace

struct HeadRenderer::State {
  Look look;
  std::vector<std::array<std::uint32_t, 3>> triangles;  // of drawn surfaces
  std::vector<std::uint16_t> surface;                   // of each triangle
  std::vector<Vec3> neutral, focus;
  std::vector<std::vector<std::uint32_t>> twins;
  float head_size = 1.0F;

  // Of the picture being drawn.
  std::vector<Vec3> view_points, normals, face_normals, twin_sums;
  std::vector<Camera::Point> screen, light_screen;
  VisibilityBuffer visible, shadow;
  OcclusionInput surfaces_seen;
  std::vector<float> open, light_depth;

  State(const rig::Mesh& mesh, const Look& given);
  void project(const Camera& camera, std::span<const Vec3> points);
  void computeNormals();
  void findTwins();
  void castShadow(Vec3 towards);
  float keyLight(Vec3 view_point, Vec3 normal) const;
  Rendered render(std::span<const Vec3> points, const ViewOptions& view);

  // The light's own camera: parallel rays.
  Mat3 light_from_view;
  Vec3 light_low, light_towards;
  float light_scale = 1.0F, light_far = 0.0F;
};

HeadRenderer::State::State(const rig::Mesh& mesh, const Look& given) : look(given) {
  checkDrawable(mesh);
  if (look.polygon_surface.size() != mesh.polygonCount() || look.surfaces.empty() ||
      (!look.vertex_tint.empty() && look.vertex_tint.size() != mesh.vertexCount())) {
    throw std::invalid_argument("the look was made for another mesh");
  }
  for (std::size_t p = 0; p < mesh.polygonCount(); ++p) {
    const std::uint32_t begin = mesh.polygon_start[p], end = mesh.polygon_start[p + 1];
    if (look.polygon_surface[p] >= look.surfaces.size())
      throw std::invalid_argument("the look was made for another mesh");
    if (!look.surfaces[look.polygon_surface[p]].drawn) continue;
    for (std::uint32_t c = begin + 2; c < end; ++c) {
      triangles.push_back({mesh.corner_vertices[begin], mesh.corner_vertices[c - 1], mesh.corner_vertices[c]});
      surface.push_back(look.polygon_surface[p]);
    }
  }
  neutral.reserve(mesh.vertexCount());
  Vec3 low{1e30F, 1e30F, 1e30F}, high{-1e30F, -1e30F, -1e30F};
  for (Eigen::Index v = 0; v < mesh.positions.rows(); ++v) {
    const Vec3 p = rowOf(mesh.positions, v);
    neutral.push_back(p);
    if (!finite(p)) continue;
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }
  head_size = std::max(length(high - low), 1e-20F);
  focus = neutral;
  findTwins();
}

void HeadRenderer::State::project(const Camera& camera, std::span<const Vec3> points) {
  view_points.resize(points.size());
  screen.resize(points.size());
  for (std::size_t v = 0; v < points.size(); ++v) {
    view_points[v] = camera.viewFromMesh(points[v]);
    screen[v] = camera.projectView(view_points[v]);
    if (!finite(view_points[v])) screen[v].depth = -1.0F;
  }
}

void HeadRenderer::State::computeNormals() {
  // The sum of cross products weighs every triangle by its area.
  normals.assign(view_points.size(), Vec3{});
  face_normals.resize(triangles.size());
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    const auto& [a, b, c] = triangles[t];
    const Vec3 normal = cross(view_points[b] - view_points[a], view_points[c] - view_points[a]);
    face_normals[t] = normalised(normal);
    if (!finite(normal)) continue;
    normals[a] = normals[a] + normal;
    normals[b] = normals[b] + normal;
    normals[c] = normals[c] + normal;
  }
  // Vertices that a seam of texture coordinates has cut in two look smooth all the same; sides that face apart, like
  // closed lips, stay apart.
  twin_sums.clear();
  for (const std::vector<std::uint32_t>& group : twins) {
    for (const std::uint32_t v : group) {
      Vec3 sum = normals[v];
      for (const std::uint32_t other : group) {
        if (other != v && dot(normals[v], normals[other]) > 0.0F) sum = sum + normals[other];
      }
      twin_sums.push_back(sum);
    }
  }
  std::size_t next = 0;
  for (const std::vector<std::uint32_t>& group : twins) {
    for (const std::uint32_t v : group) normals[v] = twin_sums[next++];
  }
  for (Vec3& normal : normals) normal = normalised(normal);
}

// Vertices at the same place at neutral, where there is more than one.
void HeadRenderer::State::findTwins() {
  constexpr std::size_t kMostTwins = 16;  // more is no seam
  std::vector<std::uint32_t> order(neutral.size());
  std::iota(order.begin(), order.end(), 0U);
  const auto place = [&](std::uint32_t v) { return std::tuple(neutral[v].x, neutral[v].y, neutral[v].z); };
  std::erase_if(order, [&](std::uint32_t v) { return !finite(neutral[v]); });
  std::sort(order.begin(), order.end(),
            [&](std::uint32_t a, std::uint32_t b) { return std::tuple(place(a), a) < std::tuple(place(b), b); });
  for (std::size_t begin = 0, end = 0; begin < order.size(); begin = end) {
    while (end < order.size() && place(order[end]) == place(order[begin])) ++end;
    if (end - begin < 2 || end - begin > kMostTwins) continue;
    twins.emplace_back(order.begin() + static_cast<std::ptrdiff_t>(begin),
                       order.begin() + static_cast<std::ptrdiff_t>(end));
  }
}

void HeadRenderer::State::castShadow(Vec3 towards) {
  const Vec3 side = normalised(cross(Vec3{0, 1, 0}, towards));
  light_from_view = {side, cross(towards, side), towards};
  light_towards = towards;
  Vec3 low{1e30F, 1e30F, 1e30F}, high{-1e30F, -1e30F, -1e30F};
  light_screen.resize(view_points.size());
  for (const Vec3 point : view_points) {
    if (!finite(point)) continue;
    const Vec3 p = light_from_view * point;
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }
  light_low = low;
  light_scale = static_cast<float>(kShadowSize - 2) / std::max({high.x - low.x, high.y - low.y, 1e-20F});
  // Depth is kept as its inverse, and must be linear for parallel rays: far enough away it nearly is.
  light_far = high.z + 50.0F * head_size;
  for (std::size_t v = 0; v < view_points.size(); ++v) {
    const Vec3 p = light_from_view * view_points[v];
    light_screen[v] = {1.0F + (p.x - low.x) * light_scale, 1.0F + (p.y - low.y) * light_scale,
                       finite(view_points[v]) ? light_far - p.z : -1.0F};
  }
  rasterise(light_screen, triangles, kShadowSize, kShadowSize, 1, 0.0F, shadow);
  light_depth.resize(shadow.inverse_depth.size());
  for (std::size_t i = 0; i < light_depth.size(); ++i) {
    light_depth[i] =
        shadow.inverse_depth[i] > 0.0F ? 1.0F / shadow.inverse_depth[i] : std::numeric_limits<float>::max();
  }
}

// How much of the key light reaches a point, by comparing with the light's z-buffer around it; softer the wider it
// looks.
float HeadRenderer::State::keyLight(Vec3 view_point, Vec3 normal) const {
  // Lifted off the surface, more where the light grazes it: the map's texels are flat steps there.
  const float grazing = 1.0F - std::clamp(dot(normal, light_towards), 0.0F, 1.0F);
  const Vec3 p = light_from_view * (view_point + normal * ((0.004F + 0.010F * grazing) * head_size));
  const float x = 1.0F + (p.x - light_low.x) * light_scale, y = 1.0F + (p.y - light_low.y) * light_scale;
  const float depth = light_far - p.z, soft = 0.014F * head_size;
  // Two rings of a disc: the light is as wide as a window.
  static const std::array<std::array<float, 2>, 25> kTaps = [] {
    std::array<std::array<float, 2>, 25> taps{};
    std::size_t i = 1;
    for (const auto& [count, radius] : {std::pair{8, 0.5F}, std::pair{16, 1.0F}}) {
      for (int k = 0; k < count; ++k, ++i) {
        const double angle = (k + 0.25) * 2.0 * 3.14159265358979 / count;
        taps[i] = {radius * static_cast<float>(std::cos(angle)), radius * static_cast<float>(std::sin(angle))};
      }
    }
    return taps;
  }();
  constexpr float kReach = kShadowSize * 0.011F;
  float lit = 0.0F;
  for (const auto& tap : kTaps) {
    const int column = std::clamp(static_cast<int>(x + kReach * tap[0]), 0, kShadowSize - 1);
    const int row = std::clamp(static_cast<int>(y + kReach * tap[1]), 0, kShadowSize - 1);
    const float nearest = light_depth[static_cast<std::size_t>(row) * kShadowSize + static_cast<std::size_t>(column)];
    lit += 1.0F - std::clamp((depth - nearest) / soft, 0.0F, 1.0F);
  }
  return lit / static_cast<float>(kTaps.size());
}

Rendered HeadRenderer::State::render(std::span<const Vec3> points, const ViewOptions& view) {
  Rendered out;
  out.picture = Picture(view.width_px, view.height_px);
  out.camera = fitCamera(focus, view);
  const Camera& camera = out.camera;
  project(camera, points);
  computeNormals();
  const int samples = view.samples;
  rasterise(screen, triangles, view.width_px, view.height_px, samples, 0.05F * camera.distance, visible);
  const LightSet lights = lightSet(view.lighting);
  castShadow(lights.lights[0].towards);

  // Weights of a triangle's corners at a sample, right in perspective.
  const auto cornersAt = [&](std::uint32_t triangle, float x, float y) {
    const auto& [ia, ib, ic] = triangles[triangle];
    const Camera::Point &a = screen[ia], &b = screen[ib], &c = screen[ic];
    const auto edge = [&](const Camera::Point& p, const Camera::Point& q) {
      return (q.x_px - p.x_px) * (y - p.y_px) - (q.y_px - p.y_px) * (x - p.x_px);
    };
    Vec3 w{edge(b, c) / a.depth, edge(c, a) / b.depth, edge(a, b) / c.depth};
    const float sum = w.x + w.y + w.z;
    if (!(std::abs(sum) > 0.0F)) return Vec3{1.0F / 3, 1.0F / 3, 1.0F / 3};
    w = w * (1.0F / sum);
    w = {std::clamp(w.x, 0.0F, 1.0F), std::clamp(w.y, 0.0F, 1.0F), std::clamp(w.z, 0.0F, 1.0F)};
    return w * (1.0F / (w.x + w.y + w.z));
  };
  const auto blended = [&](const std::vector<Vec3>& values, std::uint32_t triangle, Vec3 w) {
    const auto& [a, b, c] = triangles[triangle];
    return values[a] * w.x + values[b] * w.y + values[c] * w.z;
  };
  // The shading normal on the side that is seen.
  const auto normalAt = [&](std::uint32_t triangle, Vec3 w, Vec3 to_viewer) {
    Vec3 normal = blended(normals, triangle, w);
    if (dot(face_normals[triangle], to_viewer) < 0.0F) normal = -normal;
    const float facing = dot(normal, to_viewer);
    if (facing < 0.02F) normal = normal + to_viewer * (0.02F - facing);
    return normalised(normal);
  };
  const Vec3 eye{0.0F, 0.0F, camera.distance};

  // One position and normal per pixel, for what lies open and what is tucked away.
  const std::size_t pixels = static_cast<std::size_t>(view.width_px) * static_cast<std::size_t>(view.height_px);
  surfaces_seen.width = view.width_px;
  surfaces_seen.height = view.height_px;
  surfaces_seen.focal_px = camera.focal_px;
  surfaces_seen.middle_x = camera.middle_x;
  surfaces_seen.middle_y = camera.middle_y;
  surfaces_seen.depth.assign(pixels, 0.0F);
  surfaces_seen.normal.assign(pixels, Vec3{});
  out.depth.assign(pixels, std::numeric_limits<float>::infinity());
  const std::size_t stride = static_cast<std::size_t>(visible.width);
  const float per_sample = 1.0F / static_cast<float>(samples);
  for (int y = 0; y < view.height_px; ++y) {
    for (int x = 0; x < view.width_px; ++x) {
      const int sx = x * samples + samples / 2, sy = y * samples + samples / 2;
      const std::size_t at = static_cast<std::size_t>(sy) * stride + static_cast<std::size_t>(sx);
      const std::uint32_t triangle = visible.triangle[at];
      if (triangle == kNoTriangle) continue;
      const Vec3 w = cornersAt(triangle, (static_cast<float>(sx) + 0.5F) * per_sample,
                               (static_cast<float>(sy) + 0.5F) * per_sample);
      const std::size_t pixel =
          static_cast<std::size_t>(y) * static_cast<std::size_t>(view.width_px) + static_cast<std::size_t>(x);
      const Vec3 position = blended(view_points, triangle, w);
      surfaces_seen.depth[pixel] = camera.distance - position.z;
      surfaces_seen.normal[pixel] = normalAt(triangle, w, normalised(eye - position));
      out.depth[pixel] = surfaces_seen.depth[pixel];
    }
  }
  surfaces_seen.radius = 0.075F * head_size;
  ambientOcclusion(surfaces_seen, open);

  const auto colourAt = [&](std::uint32_t triangle, float x, float y, std::size_t pixel) {
    const Vec3 w = cornersAt(triangle, x, y);
    const Vec3 position = blended(view_points, triangle, w), to_viewer = normalised(eye - position);
    const Vec3 normal = normalAt(triangle, w, to_viewer);
    const Surface& material = look.surfaces[surface[triangle]];
    Vec3 albedo = material.albedo;
    if (material.eyeball >= 0) {
      const Eyeball& ball = look.eyeballs[static_cast<std::size_t>(material.eyeball)];
      albedo = eyeballAlbedo(ball, albedo, blended(neutral, triangle, w) - ball.centre);
    }
    if (!look.vertex_tint.empty()) albedo = albedo * blended(look.vertex_tint, triangle, w);
    return toneMapped(shade(material, albedo, normal, to_viewer, lights, open[pixel], keyLight(position, normal)));
  };
  // Neighbours on the same smooth surface.
  const auto goesOn = [&](std::uint32_t a, std::uint32_t b) {
    if (surface[a] != surface[b] || look.surfaces[surface[a]].eyeball >= 0 ||
        dot(face_normals[a], face_normals[b]) < 0.94F) {
      return false;
    }
    for (const std::uint32_t p : triangles[a]) {
      if (p == triangles[b][0] || p == triangles[b][1] || p == triangles[b][2]) return true;
    }
    return false;
  };

  const Vec3 top{view.background_top[0], view.background_top[1], view.background_top[2]};
  const Vec3 bottom{view.background_bottom[0], view.background_bottom[1], view.background_bottom[2]};
  const auto backgroundAt = [&](int x, int y) {
    const float dx = (static_cast<float>(x) + 0.5F) / static_cast<float>(view.width_px) - 0.5F;
    const float dy = (static_cast<float>(y) + 0.5F) / static_cast<float>(view.height_px) - 0.42F;
    return mix(top, bottom, std::clamp(1.55F * std::sqrt(dx * dx + dy * dy), 0.0F, 1.0F));
  };
  for (int y = 0; y < view.height_px; ++y) {
    for (int x = 0; x < view.width_px; ++x) {
      const std::size_t pixel =
          static_cast<std::size_t>(y) * static_cast<std::size_t>(view.width_px) + static_cast<std::size_t>(x);
      const std::size_t first = static_cast<std::size_t>(y * samples) * stride + static_cast<std::size_t>(x * samples);
      // A triangle is shaded once per pixel; one that goes on smoothly from the triangle before is not shaded at all.
      std::array<std::uint32_t, 16> seen;
      std::array<Vec3, 16> colour;
      std::size_t kinds = 0;
      int empty = 0;
      Vec3 sum{};
      for (int j = 0; j < samples; ++j) {
        for (int i = 0; i < samples; ++i) {
          const std::uint32_t triangle =
              visible.triangle[first + static_cast<std::size_t>(j) * stride + static_cast<std::size_t>(i)];
          if (triangle == kNoTriangle) {
            ++empty;
            continue;
          }
          std::size_t k = 0;
          while (k < kinds && seen[k] != triangle && !goesOn(seen[k], triangle)) ++k;
          if (k == kinds) {
            seen[kinds] = triangle;
            colour[kinds++] = colourAt(triangle, static_cast<float>(x) + (static_cast<float>(i) + 0.5F) * per_sample,
                                       static_cast<float>(y) + (static_cast<float>(j) + 0.5F) * per_sample, pixel);
          }
          sum = sum + colour[k];
        }
      }
      if (empty > 0) sum = sum + backgroundAt(x, y) * static_cast<float>(empty);
      sum = sum * (per_sample * per_sample);
      out.picture.rgb[3 * pixel] = srgb(sum.x);
      out.picture.rgb[3 * pixel + 1] = srgb(sum.y);
      out.picture.rgb[3 * pixel + 2] = srgb(sum.z);
    }
  }
  return out;
}

HeadRenderer::HeadRenderer(const rig::Mesh& mesh) : HeadRenderer(mesh, lookOf(mesh)) {}
HeadRenderer::HeadRenderer(const rig::Mesh& mesh, const Look& look) : state_(std::make_unique<State>(mesh, look)) {}
HeadRenderer::~HeadRenderer() = default;
HeadRenderer::HeadRenderer(HeadRenderer&&) noexcept = default;
HeadRenderer& HeadRenderer::operator=(HeadRenderer&&) noexcept = default;

void HeadRenderer::focusOn(std::span<const Vec3> points) { state_->focus.assign(points.begin(), points.end()); }

Rendered HeadRenderer::render(const rig::VertexPositions& positions, const ViewOptions& view) {
  if (static_cast<std::size_t>(positions.rows()) != state_->neutral.size()) {
    throw std::invalid_argument("the mesh has " + std::to_string(state_->neutral.size()) + " vertices, " +
                                std::to_string(positions.rows()) + " positions were given");
  }
  std::vector<Vec3> points;
  points.reserve(state_->neutral.size());
  for (Eigen::Index v = 0; v < positions.rows(); ++v) points.push_back(rowOf(positions, v));
  return state_->render(points, view);
}

Rendered HeadRenderer::render(std::span<const std::array<float, 3>> positions, const ViewOptions& view) {
  if (positions.size() != state_->neutral.size()) {
    throw std::invalid_argument("the mesh has " + std::to_string(state_->neutral.size()) + " vertices, " +
                                std::to_string(positions.size()) + " positions were given");
  }
  std::vector<Vec3> points;
  points.reserve(positions.size());
  for (const auto& p : positions) points.push_back({p[0], p[1], p[2]});
  return state_->render(points, view);
}

Rendered HeadRenderer::render(const ViewOptions& view) { return state_->render(state_->neutral, view); }

Picture renderMesh(const rig::Mesh& mesh, const rig::VertexPositions& positions, const ViewOptions& view) {
  return HeadRenderer(mesh).render(positions, view).picture;
}

}  // namespace volto::picture
