#include "rig/json_text.h"

#include <algorithm>
#include <set>
#include <vector>

#include <nlohmann/json.hpp>

#include "rig/errors.h"

namespace volto::rig {
namespace {

using Json = nlohmann::json;

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

// nlohmann's own message, without its error number.
std::string reason(const std::string& what) {
  const std::size_t bracket = what.find("] ");
  return bracket == std::string::npos ? what : what.substr(bracket + 2);
}

}  // namespace

nlohmann::json parseJsonText(std::string_view text, const std::string& name_for_errors, int max_depth) {
  const auto fail = [&](const std::string& what) { throw InputError(name_for_errors + ": " + what); };
  std::vector<std::set<std::string>> keys;
  const auto watch = [&](int depth, Json::parse_event_t event, Json& parsed) {
    if (depth > max_depth) fail("nested deeper than " + std::to_string(max_depth) + " levels");
    if (event == Json::parse_event_t::object_start) keys.emplace_back();
    if (event == Json::parse_event_t::object_end) keys.pop_back();
    if (event == Json::parse_event_t::key && !keys.back().insert(parsed.get<std::string>()).second)
      fail("\"" + shownKey(parsed.get<std::string>()) + "\" is given twice");
    return true;
  };
  try {
    return Json::parse(text.begin(), text.end(), watch);
  } catch (const Json::exception& e) {
    std::string message = reason(e.what());
    for (char& c : message)
      if (c < ' ' || c > '~') c = '?';
    fail("not valid JSON: " + message.substr(0, 300));
  }
  return {};
}

std::string shownKey(std::string_view key) {
  std::string out;
  for (const char c : key.substr(0, 40)) out += c >= ' ' && c < 0x7F ? c : '?';
  return out;
}

std::string_view nearestName(std::string_view name, std::span<const std::string_view> names) {
  name = name.substr(0, 40);
  return *std::min_element(names.begin(), names.end(), [name](std::string_view a, std::string_view b) {
    return editDistance(name, a) < editDistance(name, b);
  });
}

}  // namespace volto::rig
