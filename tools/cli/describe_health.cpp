#include "tools/cli/describe_health.h"

#include <algorithm>
#include <cstdio>

#include <nlohmann/json.hpp>

#include "retarget/expression_health.h"
#include "rig/rig_health.h"

namespace volto::cli {

namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kListed = 50;  // of a list of vertices; beyond that its length says enough

Json vertexList(const std::vector<std::uint32_t>& vertices) {
  Json first = Json::array();
  for (std::size_t i = 0; i < std::min(vertices.size(), kListed); ++i) first.push_back(vertices[i]);
  return {{"count", vertices.size()}, {"first", std::move(first)}};
}

Json triangleIds(std::size_t triangle) {
  Json ids = Json::array();
  for (const std::uint8_t p : rig::maskTriangles()[triangle]) ids.push_back(rig::featurePoints()[p].id);
  return ids;
}

Json regionsOf(const rig::RigHealth& health) {
  Json all = Json::array();
  for (std::size_t t = 0; t < rig::kMaskTriangleCount; ++t) {
    const rig::RegionHealth& region = health.regions[t];
    all.push_back({{"triangle", triangleIds(t)},
                   {"vertices", region.vertices},
                   {"control_points", region.control_points},
                   {"condition", region.condition}});
  }
  const auto [least, most] = std::minmax_element(health.regions.begin(), health.regions.end(),
                                                 [](const auto& a, const auto& b) { return a.vertices < b.vertices; });
  return {{"count", rig::kMaskTriangleCount},
          {"without_vertices", health.empty_regions.size()},
          {"fewest_vertices", least->vertices},
          {"most_vertices", most->vertices},
          {"worst_condition", health.regions[health.worst_condition].condition},
          {"worst_condition_at", triangleIds(health.worst_condition)},
          {"each", std::move(all)}};
}

Json expressionsOf(const rig::Rig& rig, Json& problems) {
  const retarget::ExpressionHealth health = retarget::measureExpressions(rig);
  Json flipping = Json::array();
  const retarget::PoseHealth* worst = nullptr;
  for (const auto* list : {&health.shapes, &health.combinations})
    for (const retarget::PoseHealth& pose : *list) {
      if (pose.flipped > 0)
        flipping.push_back({{"name", pose.name}, {"triangles", pose.flipped}, {"of_skin", pose.flipped_skin}});
      if (pose.flipped > 0 && (worst == nullptr || pose.flipped > worst->flipped)) worst = &pose;
    }
  const retarget::PoseHealth deepest = health.worst();
  if (worst != nullptr)
    problems.push_back(std::to_string(flipping.size()) + " expressions turn triangles over" +
                       (health.flippedSkin() > 0 ? "" : ", none of the skin itself but in its parts") +
                       ", most of all " + worst->name + " (" + std::to_string(worst->flipped) +
                       "): look at the picture of it (--picture)");
  return {{"shapes", health.shapes.size()},
          {"combinations", health.combinations.size()},
          {"flipped_triangles", health.flipped()},
          {"flipped_triangles_of_skin", health.flippedSkin()},
          {"degenerate_triangles", health.degenerate()},
          {"flipping", std::move(flipping)},
          {"eyeball_depth_es", deepest.eyeball_depth_es},
          {"lids_depth_es", deepest.lids_depth_es},
          {"lips_depth_es", deepest.lips_depth_es},
          {"blink_gap_es", health.blink_gap_es},
          {"symmetry_es", health.symmetry_es},
          {"border_es", health.border_es}};
}

}  // namespace

Json describeHealth(const rig::Rig& rig, Json& problems) {
  const rig::RigHealth health = rig::inspectRig(rig);
  for (const std::string& line : health.problems) problems.push_back(line);
  Json out;
  out["vertices"] = {{"ray", health.vertices[0]},
                     {"geodesic", health.vertices[1]},
                     {"rigid_part", health.vertices[2]},
                     {"outside", health.vertices[3]}};
  out["unassigned"] = vertexList(health.torn);
  out["doubtful"] = vertexList(health.doubtful);
  out["regions"] = regionsOf(health);
  out["smoothness"] = {{"border_jump", health.smoothness.relative()}, {"border_edges", health.smoothness.edges}};
  out["expressions"] = expressionsOf(rig, problems);
  return out;
}

std::string healthInWords(const Json& health, const Json& problems) {
  char line[400];
  std::string text;
  const Json& vertices = health["vertices"];
  std::snprintf(line, sizeof line,
                "vertices: %zu follow the mask (%zu by their normal, %zu along the skin), %zu are in parts, %zu stay\n",
                vertices["ray"].get<std::size_t>() + vertices["geodesic"].get<std::size_t>(),
                vertices["ray"].get<std::size_t>(), vertices["geodesic"].get<std::size_t>(),
                vertices["rigid_part"].get<std::size_t>(), vertices["outside"].get<std::size_t>());
  text += line;
  const Json& regions = health["regions"];
  std::snprintf(line, sizeof line,
                "regions: %zu to %zu vertices each, condition at most %.2g, jump at borders %.2g %% of the motion\n",
                regions["fewest_vertices"].get<std::size_t>(), regions["most_vertices"].get<std::size_t>(),
                regions["worst_condition"].get<double>(), 100 * health["smoothness"]["border_jump"].get<double>());
  text += line;
  const Json& expressions = health["expressions"];
  std::snprintf(line, sizeof line,
                "expressions: %zu triangles turn over (%zu of the skin) in %zu shapes and %zu combinations, %zu degenerate; doubtful "
                "vertices: %zu, unassigned: %zu\n",
                expressions["flipped_triangles"].get<std::size_t>(),
                expressions["flipped_triangles_of_skin"].get<std::size_t>(), expressions["shapes"].get<std::size_t>(),
                expressions["combinations"].get<std::size_t>(), expressions["degenerate_triangles"].get<std::size_t>(),
                health["doubtful"]["count"].get<std::size_t>(), health["unassigned"]["count"].get<std::size_t>());
  text += line;
  std::snprintf(line, sizeof line,
                "deepest, in %% of the eye separation: eyeball %.2f, lids %.2f, lips %.2f; open at a blink %.2f; left "
                "against right %.4f; border %.4f\n",
                100 * expressions["eyeball_depth_es"].get<double>(), 100 * expressions["lids_depth_es"].get<double>(),
                100 * expressions["lips_depth_es"].get<double>(), 100 * expressions["blink_gap_es"].get<double>(),
                100 * expressions["symmetry_es"].get<double>(), 100 * expressions["border_es"].get<double>());
  text += line;
  for (const Json& problem : problems) text += "problem: " + problem.get<std::string>() + "\n";
  return text;
}

}  // namespace volto::cli
