// P.json: which vertex or position of a mesh is which feature point.
#include <algorithm>
#include <cmath>
#include <set>

#include <nlohmann/json.hpp>

#include "rig/build_rig.h"

namespace volto::rig {
namespace {

using Json = nlohmann::json;
constexpr int kMaxDepth = 8;

std::size_t editDistance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i + 1;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({replaced, row[j] + 1, row[j + 1] + 1});
    }
  }
  return row.back();
}

std::string nearestId(std::string_view id) {
  const auto points = featurePoints();
  return std::string(std::min_element(points.begin(), points.end(), [id](const FeaturePoint& a, const FeaturePoint& b) {
                       return editDistance(id, a.id) < editDistance(id, b.id);
                     })->id);
}

// Keys come from files: what is shown of them is short and printable.
std::string shown(std::string_view key) {
  std::string out;
  for (const char c : key.substr(0, 40)) out += c >= ' ' && c < 0x7F ? c : '?';
  return out;
}

class Reader {
 public:
  Reader(std::string_view json, const std::string& name) : text_(json), name_(name) {}

  FeaturePointChoices read() {
    const Json root = parse();
    if (!root.is_object()) fail("expected an object {\"feature_points\": {...}}");
    const auto points = root.find("feature_points");
    if (points == root.end()) fail("no \"feature_points\"; expected {\"feature_points\": {\"2.1\": 4711, ...}}");
    if (!points->is_object()) fail("\"feature_points\" must be an object {\"2.1\": 4711, ...}");
    FeaturePointChoices choices;
    for (const auto& [id, value] : points->items()) {
      const auto index = featurePointIndex(id);
      if (!index)
        fail("unknown feature point \"" + shown(id) + "\"; did you mean \"" +
             nearestId(std::string_view(id).substr(0, 40)) + "\"?");
      choices.emplace(*index, choice(id, value));
    }
    return choices;
  }

 private:
  [[noreturn]] void fail(const std::string& what) const { throw InputError(name_ + ": " + what); }
  [[noreturn]] void failPoint(const std::string& id, const std::string& what) const {
    fail("feature point " + id + ": " + what + "; expected a 0-based vertex index or [x, y, z]");
  }

  // nlohmann's own message, without its error number.
  static std::string reason(const std::string& what) {
    const std::size_t bracket = what.find("] ");
    return bracket == std::string::npos ? what : what.substr(bracket + 2);
  }

  Json parse() const {
    std::vector<std::set<std::string>> keys;
    const auto watch = [&](int depth, Json::parse_event_t event, Json& parsed) {
      if (depth > kMaxDepth) fail("nested deeper than " + std::to_string(kMaxDepth) + " levels");
      if (event == Json::parse_event_t::object_start) keys.emplace_back();
      if (event == Json::parse_event_t::object_end) keys.pop_back();
      if (event == Json::parse_event_t::key && !keys.back().insert(parsed.get<std::string>()).second)
        fail("\"" + shown(parsed.get<std::string>()) + "\" is given twice");
      return true;
    };
    try {
      return Json::parse(text_.begin(), text_.end(), watch);
    } catch (const Json::exception& e) {
      std::string message = reason(e.what());
      for (char& c : message)
        if (c < ' ' || c > '~') c = '?';
      fail("not valid JSON: " + message.substr(0, 300));
    }
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
