#include "rig/rig_definition.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <nlohmann/json.hpp>

#include "rig/json_text.h"

namespace volto::rig {
namespace {

using Json = nlohmann::json;
using OrderedJson = nlohmann::ordered_json;

constexpr std::array<std::string_view, 5> kFollows = {"head", "jaw", "left eye", "right eye", "skin"};

class Reader {
 public:
  Reader(std::string_view text, const std::string& name) : text_(text), name_(name) {}

  RigDefinition read() {
    const Json root = parseJsonText(text_, name_);
    keys(root, "", {"feature_points", "fade_out", "blend_width", "labels", "regions", "parts", "subdivision"});
    RigDefinition out;
    if (const auto at = root.find("feature_points"); at != root.end())
      out.points = parseFeaturePoints(Json{{"feature_points", *at}}.dump(), name_);
    if (const auto at = root.find("fade_out"); at != root.end()) out.fade_out_es = number(*at, "fade_out", 0.1, 5);
    if (const auto at = root.find("blend_width"); at != root.end()) out.blend_width = number(*at, "blend_width", 0, 5);
    if (const auto at = root.find("labels"); at != root.end()) labels(*at, out);
    if (const auto at = root.find("regions"); at != root.end()) regions(*at, out);
    if (const auto at = root.find("parts"); at != root.end()) parts(*at, out);
    if (const auto at = root.find("subdivision"); at != root.end()) subdivision(*at, out);
    return out;
  }

 private:
  [[noreturn]] void fail(const std::string& where, const std::string& what) const {
    throw InputError(name_ + ": " + (where.empty() ? "" : where + ": ") + what);
  }

  void keys(const Json& object, const std::string& where, std::initializer_list<std::string_view> known) const {
    if (!object.is_object()) fail(where, "must be an object {...}, it is " + std::string(object.type_name()));
    for (const auto& [key, value] : object.items())
      if (std::find(known.begin(), known.end(), key) == known.end())
        fail(where, "unknown key \"" + shownKey(key) + "\"; did you mean \"" +
                        std::string(nearestName(key, std::span(known.begin(), known.size()))) + "\"?");
  }
  const Json& list(const Json& value, const std::string& where) const {
    if (!value.is_array()) fail(where, "must be a list [...], it is " + std::string(value.type_name()));
    return value;
  }
  double number(const Json& value, const std::string& where, double low, double high) const {
    const double x = value.is_number() ? value.get<double>() : std::nan("");
    if (!(x >= low && x <= high)) {
      std::string shown = value.dump().substr(0, 40);
      fail(where, "must be a number from " + shortNumber(low) + " to " + shortNumber(high) + ", it is " + shownKey(shown));
    }
    return x;
  }
  static std::string shortNumber(double x) {
    char text[32];
    std::snprintf(text, sizeof text, "%.10g", x);
    return text;
  }
  std::size_t index(const Json& value, const std::string& where, std::size_t most) const {
    if (!value.is_number_unsigned() || value.get<std::uint64_t>() > most)
      fail(where, "must be a whole number from 0 to " + std::to_string(most) + ", it is " + shownKey(value.dump().substr(0, 40)));
    return value.get<std::size_t>();
  }
  std::uint32_t vertex(const Json& value, const std::string& where) const {
    return static_cast<std::uint32_t>(index(value, where, 0xFFFFFFFFU));
  }
  std::string word(const Json& value, const std::string& where) const {
    if (!value.is_string()) fail(where, "must be a name in quotes, it is " + shownKey(value.dump().substr(0, 40)));
    return value.get<std::string>();
  }
  template <std::size_t N>
  std::size_t oneOf(const Json& value, const std::string& where, const std::array<std::string_view, N>& names) const {
    std::string given = word(value, where);
    std::replace(given.begin(), given.end(), '_', ' ');
    const auto at = std::find(names.begin(), names.end(), given);
    if (at == names.end())
      fail(where, "\"" + shownKey(given) + "\" is none; did you mean \"" + std::string(nearestName(given, names)) + "\"?");
    return static_cast<std::size_t>(at - names.begin());
  }
  std::size_t point(const std::string& id, const std::string& where) const {
    if (const auto p = featurePointIndex(id)) return *p;
    std::vector<std::string_view> ids;
    for (const FeaturePoint& known : featurePoints()) ids.push_back(known.id);
    fail(where, "unknown feature point \"" + shownKey(id) + "\"; did you mean \"" + std::string(nearestName(id, ids)) + "\"?");
  }

  // A triangle of the control mask, by number or by its three points in any order.
  std::uint8_t triangle(const Json& value, const std::string& where) const {
    if (!value.is_array()) return static_cast<std::uint8_t>(index(value, where, kMaskTriangleCount - 1));
    if (value.size() != 3) fail(where, "a triangle has three feature points or is a number from 0 to 135");
    std::array<std::size_t, 3> wanted{};
    for (std::size_t i = 0; i < 3; ++i) wanted[i] = point(word(value[i], where), where);
    std::sort(wanted.begin(), wanted.end());
    const auto all = maskTriangles();
    for (std::size_t t = 0; t < all.size(); ++t) {
      std::array<std::size_t, 3> corners{all[t][0], all[t][1], all[t][2]};
      std::sort(corners.begin(), corners.end());
      if (corners == wanted) return static_cast<std::uint8_t>(t);
    }
    fail(where, "the control mask has no triangle " + shownKey(value.dump()));
  }
  std::vector<std::uint8_t> triangles(const Json& value, const std::string& where) const {
    std::vector<std::uint8_t> out;
    for (std::size_t i = 0; i < list(value, where).size(); ++i)
      out.push_back(triangle(value[i], where + "[" + std::to_string(i) + "]"));
    return out;
  }

  static std::array<std::string_view, kFaceRegionCount> regionNames() {
    std::array<std::string_view, kFaceRegionCount> names;
    for (std::size_t r = 0; r < kFaceRegionCount; ++r) names[r] = regionName(static_cast<FaceRegion>(r));
    return names;
  }

  void labels(const Json& value, RigDefinition& out) const {
    if (!value.is_object()) fail("labels", "must be an object {\"5.1\": \"left cheek\", ...}");
    for (const auto& [id, region] : value.items())
      out.edits.labels[static_cast<std::uint8_t>(point(id, "labels"))] =
          static_cast<FaceRegion>(oneOf(region, "labels." + id, regionNames()));
  }

  void regions(const Json& value, RigDefinition& out) const {
    for (std::size_t i = 0; i < list(value, "regions").size(); ++i) {
      const std::string where = "regions[" + std::to_string(i) + "]";
      const Json& edit = value[i];
      keys(edit, where, {"triangle", "region", "add", "remove", "stiffness"});
      if (edit.contains("triangle") == edit.contains("region")) fail(where, "needs either \"triangle\" or \"region\"");
      std::vector<std::uint8_t> of;
      if (edit.contains("triangle")) {
        of.push_back(triangle(edit["triangle"], where + ".triangle"));
      } else {
        const auto region = static_cast<FaceRegion>(oneOf(edit["region"], where + ".region", regionNames()));
        for (std::size_t t = 0; t < kMaskTriangleCount; ++t)
          if (maskTriangleRegion(t) == region) of.push_back(static_cast<std::uint8_t>(t));
      }
      for (const std::uint8_t t : of) {
        RegionEdits::Neighbourhood neighbourhood;
        if (const auto at = edit.find("add"); at != edit.end()) neighbourhood.add = triangles(*at, where + ".add");
        if (const auto at = edit.find("remove"); at != edit.end()) neighbourhood.remove = triangles(*at, where + ".remove");
        if (!neighbourhood.add.empty() || !neighbourhood.remove.empty())
          if (!out.edits.neighbourhoods.emplace(t, std::move(neighbourhood)).second)
            fail(where, "triangle " + std::to_string(t) + " has a neighbourhood already");
        if (const auto at = edit.find("stiffness"); at != edit.end())
          out.edits.stiffness[t] = number(*at, where + ".stiffness", 0.1, 10);
      }
    }
  }

  void parts(const Json& value, RigDefinition& out) const {
    for (std::size_t i = 0; i < list(value, "parts").size(); ++i) {
      const std::string where = "parts[" + std::to_string(i) + "]";
      const Json& edit = value[i];
      keys(edit, where, {"vertex", "follows", "name"});
      if (!edit.contains("vertex") || !edit.contains("follows")) fail(where, "needs \"vertex\" and \"follows\"");
      PartEdit part;
      part.vertex = vertex(edit["vertex"], where + ".vertex");
      part.follows = static_cast<RigidPartFollows>(oneOf(edit["follows"], where + ".follows", kFollows));
      if (const auto at = edit.find("name"); at != edit.end()) part.name = word(*at, where + ".name");
      if (part.name.size() > 200) fail(where + ".name", "is longer than 200 characters");
      out.parts.push_back(std::move(part));
    }
  }

  void subdivision(const Json& value, RigDefinition& out) const {
    keys(value, "subdivision", {"levels", "triangles", "budget", "vertices"});
    Subdivision& s = out.subdivision;
    if (value.contains("levels") + value.contains("budget") + value.contains("vertices") != 1)
      fail("subdivision", "needs exactly one of \"levels\", \"budget\" and \"vertices\"");
    if (const auto at = value.find("levels"); at != value.end())
      s.levels = static_cast<int>(index(*at, "subdivision.levels", 6));
    if (const auto at = value.find("budget"); at != value.end()) s.budget = index(*at, "subdivision.budget", kMaxRefinedPoints);
    if (const auto at = value.find("triangles"); at != value.end()) {
      if (s.levels == 0) fail("subdivision.triangles", "says nothing without \"levels\"");
      s.triangles = triangles(*at, "subdivision.triangles");
    }
    if (const auto at = value.find("vertices"); at != value.end())
      for (std::size_t i = 0; i < list(*at, "subdivision.vertices").size(); ++i)
        s.vertices.push_back(vertex((*at)[i], "subdivision.vertices[" + std::to_string(i) + "]"));
  }

  std::string_view text_;
  const std::string& name_;
};

OrderedJson triangleJson(std::size_t t) {
  OrderedJson out = OrderedJson::array();
  for (const std::uint8_t p : maskTriangles()[t]) out.push_back(featurePoints()[p].id);
  return out;
}

OrderedJson trianglesJson(const std::vector<std::uint8_t>& triangles) {
  OrderedJson out = OrderedJson::array();
  for (const std::uint8_t t : triangles) out.push_back(triangleJson(t));
  return out;
}

// Two levels of lines, what is inside on one line each: readable, and a change is one line of a difference.
std::string lines(const OrderedJson& root) {
  std::string out = "{";
  const char* comma = "";
  for (const auto& [key, value] : root.items()) {
    out += std::string(comma) + "\n  " + OrderedJson(key).dump() + ": ";
    comma = ",";
    const bool open = (value.is_object() || value.is_array()) && !value.empty() && value.dump().size() > 90;
    if (!open) {
      out += value.dump();
      continue;
    }
    out += value.is_object() ? "{" : "[";
    const char* inner = "";
    for (const auto& [name, item] : value.items()) {
      out += std::string(inner) + "\n    " + (value.is_object() ? OrderedJson(name).dump() + ": " : "") + item.dump();
      inner = ",";
    }
    out += value.is_object() ? "\n  }" : "\n  ]";
  }
  return out + "\n}\n";
}

}  // namespace

void RigDefinition::applyTo(RigOptions& options) const {
  if (fade_out_es) options.fade_out_es = *fade_out_es;
  if (blend_width) options.blend_width = *blend_width;
  options.edits = edits;
  options.parts = parts;
  if (subdivision.any()) options.subdivision = subdivision;
}

void RigDefinition::check(const Mesh& mesh) const {
  for (const PartEdit& part : parts)
    if (part.vertex >= mesh.vertexCount())
      throw InputError("parts: vertex " + std::to_string(part.vertex) + " is not there, the mesh has " +
                       std::to_string(mesh.vertexCount()));
}

RigDefinition parseRigDefinition(std::string_view json, const std::string& name_for_errors) {
  return Reader(json, name_for_errors).read();
}

std::string formatRigDefinition(const RigDefinition& d) {
  OrderedJson root = OrderedJson::object();
  OrderedJson points = OrderedJson::object();
  for (const auto& [p, choice] : d.points) {
    const std::string id(featurePoints()[p].id);
    if (const auto* v = std::get_if<std::uint32_t>(&choice)) {
      points[id] = *v;
    } else {
      const auto& at = std::get<Eigen::Vector3d>(choice);
      points[id] = {at[0], at[1], at[2]};
    }
  }
  if (!points.empty()) root["feature_points"] = std::move(points);
  if (d.fade_out_es) root["fade_out"] = *d.fade_out_es;
  if (d.blend_width) root["blend_width"] = *d.blend_width;
  for (const auto& [p, region] : d.edits.labels) root["labels"][std::string(featurePoints()[p].id)] = regionName(region);
  for (std::size_t t = 0; t < kMaskTriangleCount; ++t) {
    const auto key = static_cast<std::uint8_t>(t);
    OrderedJson edit = {{"triangle", triangleJson(t)}};
    if (const auto at = d.edits.neighbourhoods.find(key); at != d.edits.neighbourhoods.end()) {
      if (!at->second.add.empty()) edit["add"] = trianglesJson(at->second.add);
      if (!at->second.remove.empty()) edit["remove"] = trianglesJson(at->second.remove);
    }
    if (const auto at = d.edits.stiffness.find(key); at != d.edits.stiffness.end()) edit["stiffness"] = at->second;
    if (edit.size() > 1) root["regions"].push_back(std::move(edit));
  }
  for (const PartEdit& part : d.parts) {
    OrderedJson edit = {{"vertex", part.vertex}, {"follows", kFollows[static_cast<std::size_t>(part.follows)]}};
    if (!part.name.empty()) edit["name"] = part.name;
    root["parts"].push_back(std::move(edit));
  }
  const Subdivision& s = d.subdivision;
  if (!s.vertices.empty()) {
    root["subdivision"]["vertices"] = s.vertices;
  } else if (s.budget > 0) {
    root["subdivision"]["budget"] = s.budget;
  } else if (s.levels > 0) {
    root["subdivision"]["levels"] = s.levels;
    if (!s.triangles.empty()) root["subdivision"]["triangles"] = trianglesJson(s.triangles);
  }
  return lines(root);
}

RigDefinition definitionOf(const Rig& rig, const RigOptions& options) {
  RigDefinition out;
  for (std::size_t p = 0; p < kFeaturePointCount; ++p) {
    if (rig.feature_vertex[p] >= 0)
      out.points[p] = static_cast<std::uint32_t>(rig.feature_vertex[p]);
    else
      out.points[p] = Eigen::Vector3d(rig.feature_positions.row(static_cast<Eigen::Index>(p)));
  }
  out.fade_out_es = options.fade_out_es;
  out.blend_width = options.blend_width;
  out.edits = options.edits;
  out.parts = options.parts;
  out.subdivision = options.subdivision;
  if (options.subdivision.budget > 0) {  // another set of examples would choose otherwise
    out.subdivision = {};
    for (std::size_t p = kFeaturePointCount; p < rig.refined.pointCount(); ++p)
      out.subdivision.vertices.push_back(static_cast<std::uint32_t>(rig.refined.vertex[p]));
  }
  return out;
}

}  // namespace volto::rig
