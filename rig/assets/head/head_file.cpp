// The head as text: OBJ, its MTL, and the feature points.
#include <array>
#include <charconv>
#include <cmath>
#include <map>

#include "rig/assets/head/head_mesh.h"

namespace volto::head {
namespace {

void appendNumber(std::string& out, double value, int decimals) {
  double scale = 1;
  for (int i = 0; i < decimals; ++i) scale *= 10;
  value = std::nearbyint(value * scale) / scale;
  if (value == 0) value = 0;  // no "-0.00000"
  char buffer[64];
  const auto end = std::to_chars(buffer, buffer + sizeof buffer, value, std::chars_format::fixed, decimals).ptr;
  out.append(buffer, end);
}

// sRGB, as files with colours behind the coordinates have them.
double displayFromLinear(double x) { return x <= 0.0031308 ? 12.92 * x : 1.055 * std::pow(x, 1 / 2.4) - 0.055; }

}  // namespace

std::string materialName(Material material) {
  switch (material) {
    case Material::skin:
      return "skin";
    case Material::hair:
      return "hair";
    case Material::lips:
      return "lips";
    case Material::mouth:
      return "mouth";
    case Material::nostril:
      return "nostril";
    case Material::eye_white:
      return "eye_white";
    case Material::iris:
      return "iris";
    case Material::iris_rim:
      return "iris_rim";
    case Material::pupil:
      return "pupil";
    case Material::caruncle:
      return "lid_rim";
    case Material::teeth:
      return "teeth";
    case Material::gums:
      return "gums";
    case Material::tongue:
      return "tongue";
    case Material::lashes:
      return "lashes";
    case Material::brows:
      return "brows";
    case Material::count:
      break;
  }
  return "skin";
}

std::string objText(const Head& head, const std::string& mtl_file) {
  std::string out = "# " + head.character.name +
                    ", made by volto-make-head; centimetres, +x the subject's left, +y up, +z out of the face\n";
  out += "mtllib " + mtl_file + "\n";
  for (std::size_t i = 0; i < head.vertices.size(); ++i) {
    const Vec3 &v = head.vertices[i], &tint = head.tints[i];
    out += "v ";
    appendNumber(out, v.x, 5);
    out += ' ';
    appendNumber(out, v.y, 5);
    out += ' ';
    appendNumber(out, v.z, 5);
    for (const double factor : {tint.x, tint.y, tint.z}) {
      out += ' ';
      appendNumber(out, displayFromLinear(factor), 3);
    }
    out += '\n';
  }
  // Texture coordinates in the order of their first use, each once.
  std::map<std::array<long, 2>, int> texture;
  const auto textureIndex = [&](const std::array<double, 2>& uv) {
    const std::array<long, 2> key{std::lround(uv[0] * 1e5), std::lround(uv[1] * 1e5)};
    return texture.try_emplace(key, static_cast<int>(texture.size()) + 1);
  };
  for (const Polygon& polygon : head.polygons)
    for (const auto& uv : polygon.uv)
      if (textureIndex(uv).second) {
        out += "vt ";
        appendNumber(out, uv[0], 5);
        out += ' ';
        appendNumber(out, uv[1], 5);
        out += '\n';
      }
  for (std::size_t c = 0; c < head.components.size(); ++c) {
    out += "g " + head.components[c].name + "\n";
    for (std::size_t m = 0; m < static_cast<std::size_t>(Material::count); ++m) {
      bool named = false;
      for (std::size_t p = 0; p < head.polygons.size(); ++p) {
        if (head.polygon_component[p] != static_cast<int>(c) || head.polygons[p].material != static_cast<Material>(m))
          continue;
        if (!named) out += "usemtl " + materialName(static_cast<Material>(m)) + "\n";
        named = true;
        out += 'f';
        for (std::size_t i = 0; i < head.polygons[p].corners.size(); ++i)
          out += ' ' + std::to_string(head.polygons[p].corners[i] + 1) + '/' +
                 std::to_string(textureIndex(head.polygons[p].uv[i]).first->second);
        out += '\n';
      }
    }
  }
  return out;
}

std::string mtlText(const Character& character) {
  std::string out = "# Materials of " + character.name + "\n";
  for (std::size_t m = 0; m < static_cast<std::size_t>(Material::count); ++m) {
    out += "newmtl " + materialName(static_cast<Material>(m)) + "\nKd";
    for (const double c : character.palette[m]) {
      out += ' ';
      appendNumber(out, c, 3);
    }
    out += "\n";
  }
  return out;
}

std::string pointsText(const Head& head) {
  std::string out = "{\n  \"feature_points\": {\n";
  for (std::size_t i = 0; i < head.feature_points.size(); ++i) {
    out += "    \"" + head.feature_points[i].first + "\": " + std::to_string(head.feature_points[i].second);
    out += i + 1 < head.feature_points.size() ? ",\n" : "\n";
  }
  return out + "  }\n}\n";
}

}  // namespace volto::head
