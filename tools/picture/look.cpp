#include "tools/picture/look.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <stdexcept>

namespace volto::picture {
namespace {

// Listed so that the more telling part of a name comes first: "eye_white" before "eye", "eyelashes" before "eye".
struct Known {
  std::string_view part;
  Surface surface;
};

const Vec3 kSkin{0.57F, 0.315F, 0.22F};

const std::array<Known, 30>& knownSurfaces() {
  static const std::array<Known, 30> known{{
      {"lacrimal", {"lacrimal", {0.6F, 0.4F, 0.35F}, 0.05F, 200.0F, 0.0F, false}},
      {"tear", {"tear", {0.6F, 0.4F, 0.35F}, 0.05F, 200.0F, 0.0F, false}},
      {"occlusion", {"occlusion", {0.1F, 0.08F, 0.08F}, 0.0F, 8.0F, 0.0F, false}},
      {"cornea", {"cornea", {0.9F, 0.9F, 0.9F}, 0.05F, 300.0F, 0.0F, false}},
      {"lash", {"eyelashes", {0.022F, 0.016F, 0.013F}, 0.02F, 30.0F}},
      {"brow", {"eyebrows", {0.06F, 0.03F, 0.018F}, 0.02F, 20.0F, 0.3F}},
      {"eyelid", {"skin", kSkin, 0.028F, 22.0F, 1.0F}},
      {"lid_rim", {"lid_rim", {0.58F, 0.28F, 0.22F}, 0.045F, 90.0F, 0.9F}},
      {"nostril", {"nostril", {0.16F, 0.06F, 0.05F}, 0.02F, 20.0F, 0.6F}},
      {"iris", {"iris", {0.10F, 0.17F, 0.22F}, 0.05F, 220.0F}},
      {"pupil", {"pupil", {0.004F, 0.004F, 0.004F}, 0.05F, 260.0F}},
      {"eye_white", {"eye_white", {0.74F, 0.71F, 0.69F}, 0.05F, 220.0F, 0.3F}},
      {"eyewhite", {"eye_white", {0.74F, 0.71F, 0.69F}, 0.05F, 220.0F, 0.3F}},
      {"sclera", {"eye_white", {0.74F, 0.71F, 0.69F}, 0.05F, 220.0F, 0.3F}},
      {"eyeball", {"eye_white", {0.74F, 0.71F, 0.69F}, 0.05F, 220.0F, 0.3F}},
      {"socket", {"socket", {0.30F, 0.13F, 0.10F}, 0.03F, 30.0F, 0.6F}},
      {"caruncle", {"caruncle", {0.55F, 0.22F, 0.19F}, 0.05F, 120.0F, 1.0F}},
      {"teeth", {"teeth", {0.80F, 0.72F, 0.60F}, 0.03F, 36.0F, 0.7F}},
      {"tooth", {"teeth", {0.80F, 0.72F, 0.60F}, 0.03F, 36.0F, 0.7F}},
      {"gum", {"gums", {0.34F, 0.10F, 0.09F}, 0.04F, 60.0F, 0.7F}},
      {"tongue", {"tongue", {0.47F, 0.15F, 0.14F}, 0.05F, 70.0F, 0.9F}},
      {"lip", {"lips", {0.49F, 0.165F, 0.135F}, 0.038F, 42.0F, 1.0F}},
      {"mouth", {"mouth", {0.13F, 0.032F, 0.03F}, 0.03F, 40.0F, 0.5F}},
      {"hair", {"hair", {0.07F, 0.04F, 0.025F}, 0.03F, 40.0F, 0.0F}},
      {"cloth", {"cloth", {0.05F, 0.06F, 0.08F}, 0.02F, 10.0F, 0.0F}},
      {"shirt", {"cloth", {0.05F, 0.06F, 0.08F}, 0.02F, 10.0F, 0.0F}},
      {"horn", {"horn", {0.25F, 0.20F, 0.15F}, 0.04F, 40.0F, 0.2F}},
      {"metal", {"metal", {0.4F, 0.4F, 0.42F}, 0.5F, 60.0F, 0.0F}},
      {"skin", {"skin", kSkin, 0.028F, 22.0F, 1.0F}},
      {"eye", {"eye_white", {0.74F, 0.71F, 0.69F}, 0.05F, 220.0F, 0.3F}},
  }};
  return known;
}

Vec3 position(const rig::Mesh& mesh, std::uint32_t vertex) {
  const auto row = mesh.positions.row(vertex);
  return {static_cast<float>(row.x()), static_cast<float>(row.y()), static_cast<float>(row.z())};
}

// A separate piece of the mesh.
struct Component {
  std::vector<std::uint32_t> vertices;
  Vec3 low{1e30F, 1e30F, 1e30F}, high{-1e30F, -1e30F, -1e30F};
  Vec3 centre;  // of the fitted sphere
  float radius = 0.0F;
  bool ball = false;  // round all over, or nearly
};

// Least squares sphere (|p|^2 = 2 c.p + k), solved by Cramer's rule on the 4 by 4 normal equations in double.
void fitSphere(const rig::Mesh& mesh, Component& part) {
  double mean[3]{};
  for (const std::uint32_t v : part.vertices) {
    for (int a = 0; a < 3; ++a) mean[a] += mesh.positions(v, a);
  }
  const auto n = static_cast<double>(part.vertices.size());
  for (double& m : mean) m /= n;
  double m[3][3]{}, right[3]{};
  double mean_square = 0.0;
  for (const std::uint32_t v : part.vertices) {
    for (int a = 0; a < 3; ++a) mean_square += std::pow(mesh.positions(v, a) - mean[a], 2) / n;
  }
  for (const std::uint32_t v : part.vertices) {
    double d[3], square = 0.0;
    for (int a = 0; a < 3; ++a) d[a] = mesh.positions(v, a) - mean[a], square += d[a] * d[a];
    for (int a = 0; a < 3; ++a) {
      for (int b = 0; b < 3; ++b) m[a][b] += 2.0 * d[a] * d[b];
      right[a] += d[a] * (square - mean_square);
    }
  }
  const auto determinant = [](const double(&q)[3][3]) {
    return q[0][0] * (q[1][1] * q[2][2] - q[1][2] * q[2][1]) - q[0][1] * (q[1][0] * q[2][2] - q[1][2] * q[2][0]) +
           q[0][2] * (q[1][0] * q[2][1] - q[1][1] * q[2][0]);
  };
  const double whole = determinant(m);
  if (!(std::abs(whole) > 1e-30)) return;
  double centre[3];
  for (int a = 0; a < 3; ++a) {
    double replaced[3][3];
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) replaced[i][j] = j == a ? right[i] : m[i][j];
    }
    centre[a] = determinant(replaced) / whole + mean[a];
  }
  double sum = 0.0, square_sum = 0.0;
  int octants = 0;
  for (const std::uint32_t v : part.vertices) {
    double square = 0.0;
    int octant = 0;
    for (int a = 0; a < 3; ++a) {
      const double d = mesh.positions(v, a) - centre[a];
      square += d * d;
      octant |= (d > 0.0 ? 1 : 0) << a;
    }
    octants |= 1 << octant;
    const double distance = std::sqrt(square);
    sum += distance;
    square_sum += distance * distance;
  }
  const double radius = sum / n, spread = std::sqrt(std::max(0.0, square_sum / n - radius * radius));
  part.centre = {static_cast<float>(centre[0]), static_cast<float>(centre[1]), static_cast<float>(centre[2])};
  part.radius = static_cast<float>(radius);
  part.ball = octants == 255 && spread < 0.08 * radius;
}

// Eyeballs of a mesh and films over them, told by their shape.
struct Eyes {
  std::vector<std::uint32_t> component;  // of every vertex
  std::vector<Eyeball> balls;
  std::vector<int> ball_of;  // of components: index into balls, -1
  std::vector<bool> film;    // of components: lies on a ball all over (tear fluid, painted shadow) and would hide it
};

Eyes findEyes(const rig::Mesh& mesh) {
  Eyes eyes;
  eyes.component = rig::connectedComponents(mesh);
  std::vector<Component> parts;
  for (std::uint32_t v = 0; v < eyes.component.size(); ++v) {
    if (eyes.component[v] >= parts.size()) parts.resize(eyes.component[v] + 1U);
    Component& part = parts[eyes.component[v]];
    const Vec3 p = position(mesh, v);
    if (!std::isfinite(p.x + p.y + p.z)) continue;
    part.vertices.push_back(v);
    part.low = {std::min(part.low.x, p.x), std::min(part.low.y, p.y), std::min(part.low.z, p.z)};
    part.high = {std::max(part.high.x, p.x), std::max(part.high.y, p.y), std::max(part.high.z, p.z)};
  }
  eyes.ball_of.assign(parts.size(), -1);
  eyes.film.assign(parts.size(), false);
  if (parts.empty()) return eyes;
  const auto size = [](const Component& part) { return part.vertices.empty() ? 0.0F : length(part.high - part.low); };
  const float head = size(*std::max_element(parts.begin(), parts.end(),
                                            [&](const Component& a, const Component& b) { return size(a) < size(b); }));
  std::vector<std::size_t> balls;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    if (parts[i].vertices.size() < 24 || size(parts[i]) > 0.4F * head) continue;
    fitSphere(mesh, parts[i]);
    if (parts[i].ball && parts[i].radius > 0.01F * head) balls.push_back(i);
  }
  for (const std::size_t i : balls) {
    eyes.ball_of[i] = static_cast<int>(eyes.balls.size());
    eyes.balls.push_back({parts[i].centre, {0.0F, 0.0F, 1.0F}});
  }
  // A film: no point of it is far from the ball's surface.
  for (std::size_t i = 0; i < parts.size(); ++i) {
    if (eyes.ball_of[i] >= 0 || parts[i].vertices.empty()) continue;
    for (const std::size_t ball : balls) {
      bool film = true;
      for (const std::uint32_t v : parts[i].vertices) {
        const float distance = length(position(mesh, v) - parts[ball].centre) / parts[ball].radius;
        film = film && distance > 0.85F && distance < 1.25F;
        if (!film) break;
      }
      if (film) eyes.film[i] = true;
    }
  }
  return eyes;
}

std::size_t componentOf(const rig::Mesh& mesh, const Eyes& eyes, std::size_t polygon) {
  return eyes.component[mesh.corner_vertices[mesh.polygon_start[polygon]]];
}

// Parts of a mesh that says nothing about itself.
Look lookByShape(const rig::Mesh& mesh) {
  Look look;
  look.surfaces = {surfaceByName("skin"), surfaceByName("eyeball"), surfaceByName("tear"), surfaceByName("teeth")};
  Eyes eyes = findEyes(mesh);
  const std::size_t first_ball = look.surfaces.size();
  for (std::size_t ball = 0; ball < eyes.balls.size(); ++ball) {
    Surface eye = surfaceByName("eyeball");
    eye.eyeball = static_cast<int>(ball);
    look.surfaces.push_back(eye);
  }
  look.polygon_surface.reserve(mesh.polygonCount());
  for (std::size_t p = 0; p < mesh.polygonCount(); ++p) {
    const std::size_t component = componentOf(mesh, eyes, p);
    const int ball = eyes.ball_of[component];
    look.polygon_surface.push_back(ball >= 0 ? static_cast<std::uint16_t>(first_ball + static_cast<std::size_t>(ball))
                                             : static_cast<std::uint16_t>(eyes.film[component] ? 2 : 0));
  }
  look.eyeballs = std::move(eyes.balls);
  return look;
}

bool isUnset(const rig::Mesh::Material& material) { return material.colour == rig::Mesh::Material{}.colour; }

const Known* known(std::string_view name) {
  std::string lower(name);
  for (char& c : lower) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  for (const Known& one : knownSurfaces()) {
    if (lower.find(one.part) != std::string::npos) return &one;
  }
  return nullptr;
}

// Some programs write white for every vertex.
bool hasVertexColours(const rig::Mesh& mesh) {
  if (mesh.vertex_colours.size() != mesh.vertexCount()) return false;
  for (const auto& colour : mesh.vertex_colours)
    if (colour != mesh.vertex_colours.front()) return true;
  return false;
}

// Iris and pupil on balls of a mesh whose materials name an eye but not its parts.
void paintEyes(const rig::Mesh& mesh, Look& look) {
  for (const auto& material : mesh.materials) {
    const Known* kind = known(material.name);
    if (kind != nullptr && (kind->part == "iris" || kind->part == "pupil")) return;
  }
  Eyes eyes = findEyes(mesh);
  if (eyes.balls.empty()) return;
  const std::size_t first_ball = look.surfaces.size();
  for (std::size_t ball = 0; ball < eyes.balls.size(); ++ball) {
    Surface eye = surfaceByName("eyeball");
    eye.eyeball = static_cast<int>(ball);
    look.surfaces.push_back(eye);
  }
  for (std::size_t p = 0; p < mesh.polygonCount(); ++p) {
    const int ball = eyes.ball_of[componentOf(mesh, eyes, p)];
    if (ball < 0) continue;
    Surface& eye = look.surfaces[first_ball + static_cast<std::size_t>(ball)];
    const Surface& from = look.surfaces[look.polygon_surface[p]];
    // The white is the material's where that is bright enough to be one.
    if (std::min({from.albedo.x, from.albedo.y, from.albedo.z}) > 0.45F) eye.albedo = from.albedo;
    look.polygon_surface[p] = static_cast<std::uint16_t>(first_ball + static_cast<std::size_t>(ball));
  }
  look.eyeballs = std::move(eyes.balls);
}

}  // namespace

void checkDrawable(const rig::Mesh& mesh) {
  if (mesh.polygonCount() == 0 || mesh.vertexCount() == 0) {
    throw std::invalid_argument("the mesh has no polygons; nothing can be drawn");
  }
  for (std::size_t p = 0; p < mesh.polygonCount(); ++p) {
    const std::uint32_t begin = mesh.polygon_start[p], end = mesh.polygon_start[p + 1];
    if (begin >= end || end > mesh.corner_vertices.size()) {
      throw std::invalid_argument("polygon " + std::to_string(p) + " of the mesh is damaged");
    }
    for (std::uint32_t c = begin; c < end; ++c) {
      if (mesh.corner_vertices[c] >= mesh.vertexCount()) {
        throw std::invalid_argument("polygon " + std::to_string(p) + " names vertex " +
                                    std::to_string(mesh.corner_vertices[c]) + ", the mesh has " +
                                    std::to_string(mesh.vertexCount()));
      }
    }
  }
  bool any = false;
  for (Eigen::Index v = 0; v < mesh.positions.rows() && !any; ++v) any = mesh.positions.row(v).allFinite();
  if (!any) throw std::invalid_argument("nothing to draw: no vertex has a finite position");
}

Surface surfaceByName(std::string_view name) {
  const Known* kind = known(name);
  return kind != nullptr ? kind->surface : Surface{"skin", kSkin, 0.028F, 22.0F, 1.0F};
}

bool hasOwnLook(const rig::Mesh& mesh) {
  if (hasVertexColours(mesh)) return true;
  if (mesh.polygon_material.size() != mesh.polygonCount()) return false;
  for (const auto& material : mesh.materials)
    if (!isUnset(material) || known(material.name) != nullptr) return true;
  return false;
}

Look lookOf(const rig::Mesh& mesh) {
  checkDrawable(mesh);
  if (!hasOwnLook(mesh)) return lookByShape(mesh);
  const bool coloured = hasVertexColours(mesh);
  Look look;
  if (mesh.polygon_material.size() != mesh.polygonCount() || mesh.materials.empty()) {
    look.surfaces = {surfaceByName("skin")};
    look.surfaces[0].albedo = {1.0F, 1.0F, 1.0F};
    look.polygon_surface.assign(mesh.polygonCount(), 0);
  } else {
    for (const auto& material : mesh.materials) {
      Surface surface = surfaceByName(material.name);
      surface.name = material.name;
      if (!isUnset(material))
        surface.albedo = {material.colour[0], material.colour[1], material.colour[2]};
      else if (coloured)
        surface.albedo = {1.0F, 1.0F, 1.0F};
      look.surfaces.push_back(surface);
    }
    look.polygon_surface.reserve(mesh.polygonCount());
    for (const std::uint32_t index : mesh.polygon_material) {
      look.polygon_surface.push_back(static_cast<std::uint16_t>(index < mesh.materials.size() ? index : 0));
    }
  }
  if (coloured) {
    look.vertex_tint.reserve(mesh.vertexCount());
    for (const auto& c : mesh.vertex_colours) look.vertex_tint.push_back({c[0], c[1], c[2]});
  } else {
    paintEyes(mesh, look);
  }
  return look;
}

}  // namespace volto::picture
