// P.json: which vertex or position of a mesh is which feature point.
#include <vector>

#include <nlohmann/json.hpp>

#include "rig/build_rig.h"
#include "rig/json_text.h"

namespace volto::rig {
namespace {

using Json = nlohmann::json;

std::string nearestId(std::string_view id) {
  std::vector<std::string_view> ids;
  for (const FeaturePoint& point : featurePoints()) ids.push_back(point.id);
  return std::string(nearestName(id, ids));
}

class Reader {
 public:
  Reader(std::string_view json, const std::string& name) : text_(json), name_(name) {}

  FeaturePointChoices read() {
    const Json root = parseJsonText(text_, name_);
    if (!root.is_object()) fail("expected an object {\"feature_points\": {...}}");
    const auto points = root.find("feature_points");
    if (points == root.end()) fail("no \"feature_points\"; expected {\"feature_points\": {\"2.1\": 4711, ...}}");
    if (!points->is_object()) fail("\"feature_points\" must be an object {\"2.1\": 4711, ...}");
    FeaturePointChoices choices;
    for (const auto& [id, value] : points->items()) {
      const auto index = featurePointIndex(id);
      if (!index)
        fail("unknown feature point \"" + shownKey(id) + "\"; did you mean \"" +
             nearestId(id) + "\"?");
      choices.emplace(*index, choice(id, value));
    }
    return choices;
  }

 private:
  [[noreturn]] void fail(const std::string& what) const { throw InputError(name_ + ": " + what); }
  [[noreturn]] void failPoint(const std::string& id, const std::string& what) const {
    fail("feature point " + id + ": " + what + "; expected a 0-based vertex index or [x, y, z]");
  }

  FeaturePointChoice choice(const std::string& id, const Json& value) const {
    if (value.is_object()) {  // as `volto inspect --json` writes it
      const auto vertex = value.find("vertex");
      const auto position = value.find("position");
      if (vertex != value.end() && vertex->is_number_integer() && *vertex >= 0) return choice(id, *vertex);
      if (position != value.end()) return choice(id, *position);
      failPoint(id, "neither a vertex nor a position");
    }
    if (value.is_number_unsigned()) {
      const auto vertex = value.get<std::uint64_t>();
      if (vertex > 0xFFFFFFFFULL) failPoint(id, "vertex index " + std::to_string(vertex) + " is out of range");
      return static_cast<std::uint32_t>(vertex);
    }
    if (value.is_number_integer())
      failPoint(id, "vertex index " + std::to_string(value.get<std::int64_t>()) + " is negative");
    if (value.is_array() && value.size() == 3) {
      Eigen::Vector3d position;
      for (std::size_t i = 0; i < 3; ++i) {
        if (!value[i].is_number()) failPoint(id, "a coordinate that is not a number");
        position[static_cast<Eigen::Index>(i)] = value[i].get<double>();
      }
      if (!position.allFinite()) failPoint(id, "a coordinate that is not finite");
      return position;
    }
    failPoint(id, std::string("is ") + (value.is_array() ? "an array of " + std::to_string(value.size())
                                                         : std::string("a ") + value.type_name()));
  }

  std::string_view text_;
  const std::string& name_;
};

}  // namespace

FeaturePointChoices parseFeaturePoints(std::string_view json, const std::string& name_for_errors) {
  return Reader(json, name_for_errors).read();
}

}  // namespace volto::rig
