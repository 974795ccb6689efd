#include "rig/assets/head/head_mesh.h"

#include <algorithm>
#include <limits>
#include <stdexcept>

#include "rig/assets/head/parts.h"
#include "rig/assets/head/skin_field.h"
#include "rig/assets/head/texture.h"
#include "rig/assets/head/tint.h"
#include "rig/feature_points.h"

namespace volto::head {
namespace {

// Both sides of a left half. Midline vertices are shared.
void append(Head& head, const HalfMesh& half, const std::string& name) {
  const int component = static_cast<int>(head.components.size()), first = static_cast<int>(head.vertices.size());
  std::vector<int> left(half.vertices.size()), right(half.vertices.size());
  for (std::size_t i = 0; i < half.vertices.size(); ++i) {
    left[i] = static_cast<int>(head.vertices.size());
    head.vertices.push_back(half.vertices[i].position);
    head.tints.push_back(half.vertices[i].tint);
    head.mirror.push_back(left[i]);
  }
  for (std::size_t i = 0; i < half.vertices.size(); ++i) {
    if (half.vertices[i].midline) {
      right[i] = left[i];
      continue;
    }
    const Vec3 p = half.vertices[i].position;
    right[i] = static_cast<int>(head.vertices.size());
    head.vertices.push_back({-p.x, p.y, p.z});
    head.tints.push_back(half.vertices[i].tint);
    head.mirror.push_back(left[i]);
    head.mirror[static_cast<std::size_t>(left[i])] = right[i];
  }
  for (int side = 0; side < 2; ++side)
    for (const Polygon& polygon : half.polygons) {
      Polygon out;
      out.material = polygon.material;
      for (const int c : polygon.corners)
        out.corners.push_back((side == 0 ? left : right)[static_cast<std::size_t>(c)]);
      for (const auto& [u, v] : polygon.uv) out.uv.push_back({side == 0 ? u : 1 - u, v});
      // The same corner first, so that triangulated polygons mirror too.
      if (side == 1) {
        std::reverse(out.corners.begin() + 1, out.corners.end());
        std::reverse(out.uv.begin() + 1, out.uv.end());
      }
      head.polygons.push_back(out);
      head.polygon_component.push_back(component);
    }
  head.components.push_back({name, first, static_cast<int>(head.vertices.size()) - first});
}

// A feature point on the left or in the middle, and its partner on the right ("" in the middle).
struct StripPlace {
  const char *left, *right;
  Strip strip;
  double ring, around;
};
constexpr StripPlace kOnStrips[] = {
    {"2.2", "", Strip::mouth, kLipRim, 0},
    {"2.3", "", Strip::mouth, kLipRim, 10},
    {"2.4", "2.5", Strip::mouth, kLipRim, 5},
    {"2.6", "2.7", Strip::mouth, kLipRim, 2.5},
    {"2.8", "2.9", Strip::mouth, kLipRim, 7.5},
    {"8.1", "", Strip::mouth, kLipBorder, 0},
    {"8.2", "", Strip::mouth, kLipBorder, 10},
    {"8.3", "8.4", Strip::mouth, kLipBorder, 5},
    {"8.10", "8.9", Strip::mouth, kLipBorder, 1},
    {"8.5", "8.6", Strip::mouth, kLipBorder, 3},
    {"8.7", "8.8", Strip::mouth, kLipBorder, 7},
    {"12.15", "12.16", Strip::mouth, kLipBorder, 8.5},
    {"3.1", "3.2", Strip::eye, kLidMarginFront, 4},
    {"3.3", "3.4", Strip::eye, kLidMarginFront, 12},
    {"3.7", "3.12", Strip::eye, kLidMarginFront, 8},
    {"3.11", "3.8", Strip::eye, kLidMarginFront, 0},
    {"12.5", "12.9", Strip::eye, kLidMarginFront, 2},
    {"12.6", "12.10", Strip::eye, kLidMarginFront, 6},
    {"12.7", "12.11", Strip::eye, kLidMarginFront, 14},
    {"12.8", "12.12", Strip::eye, kLidMarginFront, 10},
    {"3.9", "3.10", Strip::eye, kLidCrease, 12},
    {"3.13", "3.14", Strip::eye, kLidCrease, 4},
};

// On the skin straight behind (x, y) seen from in front, or near a place in space on the sides.
struct SkinPlace {
  const char *left, *right;
  Vec3 near;
  bool from_front;
};
constexpr SkinPlace kOnSkin[] = {
    {"2.1", "", {0, -10.75, 0}, true},
    {"2.10", "", {0, -9.7, 0}, true},
    {"2.11", "2.12", {1.75, -10.15, 0}, true},
    {"12.17", "12.18", {3.2, -9.2, 0}, true},
    {"2.13", "2.14", {5.35, -7.7, 2.6}, false},
    {"12.19", "12.20", {6.05, -5.9, 2.0}, false},
    {"10.7", "10.8", {7.0, -3.4, 1.75}, false},
    {"10.9", "10.10", {7.0, 0.35, 1.35}, false},
    {"4.1", "4.2", {1.2, 2.04, 0}, true},
    {"4.3", "4.4", {3.6, 2.46, 0}, true},
    {"4.5", "4.6", {5.05, 1.85, 0}, true},
    {"12.1", "12.3", {2.4, 2.34, 0}, true},
    {"12.2", "12.4", {4.4, 2.37, 0}, true},
    {"5.1", "5.2", {4.2, -4.1, 0}, true},
    {"5.3", "5.4", {4.9, -1.9, 0}, true},
    {"9.3", "", {0, -3.5, 0}, true},
    {"9.1", "9.2", {1.6, -3.95, 0}, true},
    {"9.5", "9.4", {0.72, -4.62, 0}, true},
    {"9.15", "", {0, -4.68, 0}, true},
    {"9.7", "9.6", {0.78, -0.15, 0}, true},
    {"9.13", "9.14", {0.95, -1.95, 0}, true},
    {"9.12", "", {0, -2.35, 0}, true},
    {"12.13", "", {0, 0.45, 0}, true},
    {"12.14", "", {0, -0.95, 0}, true},
    {"11.1", "", {0, 6.5, 0}, true},
    {"11.3", "11.2", {4.75, 5.35, 0}, true},
};

void placeFeaturePoints(Head& head, const HalfMesh& skin) {
  std::vector<std::pair<std::string, int>> found;
  const auto keep = [&](const char* left, const char* right, int v) {
    found.emplace_back(left, v);
    if (*right != '\0') found.emplace_back(right, head.mirror[static_cast<std::size_t>(v)]);
  };
  for (const StripPlace& place : kOnStrips) {
    int at = -1;
    for (std::size_t i = 0; i < skin.vertices.size() && at < 0; ++i) {
      const HalfVertex& v = skin.vertices[i];
      if (v.hold == Hold::strip && v.strip == place.strip && v.ring == place.ring && v.around == place.around)
        at = static_cast<int>(i);
    }
    if (at < 0) throw std::logic_error(std::string("head: no vertex for feature point ") + place.left);
    keep(place.left, place.right, at);
  }
  for (const SkinPlace& place : kOnSkin) {
    const Vec3 target =
        place.from_front ? castToSkin({place.near.x, place.near.y, 20}, {0, 0, -1}) : projectToSkin(place.near);
    int at = -1;
    double best = std::numeric_limits<double>::max();
    for (std::size_t i = 0; i < skin.vertices.size(); ++i) {
      const HalfVertex& v = skin.vertices[i];
      if (v.hold != Hold::skin || (*place.right == '\0') != v.midline) continue;
      const Vec3 d = v.position - target;
      if (dot(d, d) < best) {
        best = dot(d, d);
        at = static_cast<int>(i);
      }
    }
    keep(place.left, place.right, at);
  }
  for (const rig::FeaturePoint& point : rig::featurePoints()) {
    bool known = false;
    for (const auto& [id, v] : found)
      if (id == point.id) {
        head.feature_points.emplace_back(id, v);
        known = true;
      }
    if (!known) throw std::logic_error("head: no place for feature point " + std::string(point.id));
  }
}

// What all characters begin with, made once: the adult's skin without hair and with texture coordinates.
const HalfMesh& plainSkin() {
  static const HalfMesh made = [] {
    HalfMesh skin = makeCage();
    relax(skin, 8, 0.5);
    skin = split(skin);
    relax(skin, 8, 0.5);
    skin = split(skin);
    relax(skin, 8, 0.5);
    polish(skin, 3);
    unwrapSkin(skin);
    return skin;
  }();
  return made;
}

}  // namespace

Head makeHead(const Character& character) {
  HalfMesh skin = plainSkin();
  if (character.proportions.hair_thickness == 0)
    for (Polygon& polygon : skin.polygons)
      if (polygon.material == Material::hair) polygon.material = Material::skin;
  tintSkin(character.tints, skin);
  raiseHair(skin, character.proportions.hair_thickness);
  sinkNostrils(skin);
  startAtBetterCorner(skin);
  const Proportions& proportions = character.proportions;
  HalfMesh reshaped_skin = skin, eyeball = makeEyeball(proportions.iris_size, proportions.pupil_size);
  HalfMesh upper_teeth = makeUpperTeeth(), lower_teeth = makeLowerTeeth(), tongue = makeTongue();
  HalfMesh lashes = makeUpperLashes(), brow = makeBrow();
  tintEyeball(eyeball);
  for (HalfMesh* part : {&upper_teeth, &lower_teeth, &tongue}) tintMouthPart(*part);
  placeChart(eyeball, Chart::eyeball);
  placeChart(upper_teeth, Chart::upper_teeth);
  placeChart(lower_teeth, Chart::lower_teeth);
  placeChart(tongue, Chart::tongue);
  placeChart(lashes, Chart::lashes);
  placeChart(brow, Chart::brow);
  reshape(proportions, reshaped_skin);
  for (HalfMesh* part : {&upper_teeth, &lower_teeth, &tongue, &lashes}) reshape(proportions, *part);
  reshapeOnSkin(proportions, skin, reshaped_skin, brow);
  reshapeEyeball(proportions, eyeball);

  Head head;
  head.character = character;
  append(head, reshaped_skin, "skin");  // first, so that a vertex of the left half keeps its number
  append(head, eyeball, "eyeballs");
  append(head, upper_teeth, "upper_teeth");
  append(head, lower_teeth, "lower_teeth");
  append(head, tongue, "tongue");
  append(head, lashes, "lashes");
  append(head, brow, "brows");
  placeFeaturePoints(head, skin);  // found on the adult's form, so the same vertices for every character
  return head;
}

}  // namespace volto::head
