// volto evaluate: how far a set of expression meshes is from what it should be.
#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "rig/control_mask.h"
#include "rig/mesh_io.h"
#include "rig/rig_file.h"
#include "rig/slit_side.h"
#include "tools/cli/error_picture.h"
#include "tools/cli/exit_status.h"
#include "tools/cli/output_file.h"
#include "tools/cli/read_input.h"
#include "tools/cli/verb.h"
#include "tools/picture/png.h"
#include "transfer/evaluation.h"
#include "transfer/mesh_set.h"
#include "transfer/surface.h"

namespace volto::cli {
namespace {

using Json = nlohmann::ordered_json;

struct Options {
  std::string results, neutral, truth, truth_neutral, rig, vertices, picture;
  double full_scale = 0;
  bool json = false;
};

// "0-6705": first and last.
void parseRange(const std::string& text, transfer::EvaluationScope& scope) {
  if (text.empty()) return;
  const std::size_t dash = text.find('-');
  std::size_t first = 0, last = 0;
  const char* const end = text.data() + text.size();
  const char* const middle = text.data() + std::min(dash, text.size());
  const bool good = dash != std::string::npos && std::from_chars(text.data(), middle, first).ptr == middle &&
                    middle + 1 < end && std::from_chars(middle + 1, end, last).ptr == end && first <= last;
  if (!good)
    throw CommandError(kWrongUsage,
                       "--vertices " + text + ": not a range; give the first and the last vertex, as in 0-6705");
  scope.first_vertex = first;
  scope.end_vertex = last + 1;
}

void nameRegions(const rig::Rig& rig, transfer::EvaluationScope& scope) {
  for (std::size_t r = 0; r < rig::kFaceRegionCount; ++r)
    scope.region_names.emplace_back(rig::regionName(static_cast<rig::FaceRegion>(r)));
  for (std::size_t r = 0; r < rig::kFaceRegionCount; ++r)
    scope.intersecting.push_back(rig::sideOf(static_cast<rig::FaceRegion>(r)) != rig::SlitSide::none);
  scope.skin = transfer::skinTriangles(rig).triangles;
  for (const std::int16_t triangle : rig.association.triangle)
    scope.region_of_vertex.push_back(
        triangle < 0 ? std::int16_t{-1}
                     : static_cast<std::int16_t>(rig::maskTriangleRegion(static_cast<std::size_t>(triangle))));
}

// Results and truths of the same names, in order of names; what only one side has is listed.
struct Pairs {
  std::vector<std::string> names, without_truth, without_result;
  std::vector<rig::VertexPositions> results, truths;
};
Pairs pairUp(transfer::MeshSet results, transfer::MeshSet truths) {
  Pairs pairs;
  std::size_t t = 0;
  for (std::size_t r = 0; r < results.size(); ++r) {
    while (t < truths.size() && truths.names[t] < results.names[r]) pairs.without_result.push_back(truths.names[t++]);
    if (t < truths.size() && truths.names[t] == results.names[r]) {
      pairs.names.push_back(results.names[r]);
      pairs.results.push_back(std::move(results.positions[r]));
      pairs.truths.push_back(std::move(truths.positions[t++]));
    } else {
      pairs.without_truth.push_back(results.names[r]);
    }
  }
  for (; t < truths.size(); ++t) pairs.without_result.push_back(truths.names[t]);
  return pairs;
}

Json figuresJson(const transfer::ErrorFigures& f, std::optional<double> eye_separation) {
  Json json{{"vertices", f.vertices}, {"rms", f.rms}, {"maximum", f.maximum}, {"expected_rms", f.expected_rms}};
  json["relative"] = f.relative ? Json(*f.relative) : Json(nullptr);
  if (eye_separation) {
    json["rms_of_eye_separation"] = f.rms / *eye_separation;
    json["maximum_of_eye_separation"] = f.maximum / *eye_separation;
  }
  return json;
}

void printJson(const transfer::Evaluation& evaluation, const Pairs& pairs, std::optional<double> eye_separation) {
  Json expressions = Json::object();
  for (const transfer::ExpressionEvaluation& e : evaluation.expressions) {
    Json json = figuresJson(e.whole, eye_separation);
    if (!e.counted_with.empty()) json["counted_with"] = e.counted_with;
    json["flipped_triangles"] = e.flipped;
    json["area_distorted_triangles"] = e.area_distorted;
    const auto passes = [](const rig::Penetration& p) {
      return Json{{"lips", p.lips}, {"lids", p.lids}, {"eyeball", p.ball}};
    };
    if (e.result_passes) json["passes"] = passes(*e.result_passes);
    if (e.expected_passes) json["passes_expected"] = passes(*e.expected_passes);
    if (e.result_crossings) json["self_intersections"] = e.result_crossings->pairs;
    if (e.expected_crossings) json["self_intersections_expected"] = e.expected_crossings->pairs;
    for (std::size_t r = 0; r < e.regions.size(); ++r) {
      Json& region = json["regions"][evaluation.region_names[r]] = figuresJson(e.regions[r], eye_separation);
      if (e.result_crossings) region["self_intersections"] = e.result_crossings->regions[r];
      if (e.expected_crossings) region["self_intersections_expected"] = e.expected_crossings->regions[r];
    }
    expressions[e.name] = std::move(json);
  }
  const Json out{{"kind", "evaluation"},
                 {"mean_relative", evaluation.related > 0 ? Json(evaluation.mean_relative) : Json(nullptr)},
                 {"related_expressions", evaluation.related},
                 {"expressions", std::move(expressions)},
                 {"without_truth", pairs.without_truth},
                 {"without_result", pairs.without_result}};
  std::puts(out.dump(2).c_str());
}

std::string fixed4(double x) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4f", x);
  return text;
}

void printTable(const transfer::Evaluation& evaluation, const Pairs& pairs, std::optional<double> eye_separation) {
  std::printf("%-24s %8s %10s %10s%s %8s %9s%s\n", "expression", "relative", "rms", "maximum",
              eye_separation ? "  max/eyes" : "", "flipped", "distorted", eye_separation ? "   passes  crossing" : "");
  for (const transfer::ExpressionEvaluation& e : evaluation.expressions) {
    std::printf("%-24s ", e.name.c_str());
    if (e.whole.relative)
      std::printf("%8.4f", *e.whole.relative);
    else
      std::printf("%8s", "still");
    std::printf(" %10.5g %10.5g", e.whole.rms, e.whole.maximum);
    if (eye_separation) std::printf(" %8.2f %%", 100 * e.whole.maximum / *eye_separation);
    std::printf(" %8zu %9zu", e.flipped, e.area_distorted);
    if (eye_separation && e.result_passes)
      std::printf(" %6.2f %%",
                  100 * static_cast<double>(std::max(e.result_passes->lips, e.result_passes->lids)) / *eye_separation);
    if (e.result_crossings) std::printf(" %4zu/%zu", e.result_crossings->pairs, e.expected_crossings->pairs);
    std::puts(e.counted_with.empty() ? "" : "  *");
  }
  std::printf("mean relative error of %zu: %.4f\n", evaluation.related, evaluation.mean_relative);
  if (eye_separation) {
    std::puts("passes: how far lips or lids have gone through each other, of the eye separation");
    std::puts("crossing: pairs of the skin's triangles in lips or lids that go through each other and do not at rest, in "
              "the result / expected");
  }
  for (const transfer::ExpressionEvaluation& e : evaluation.expressions)
    if (!e.counted_with.empty())
      std::printf("* %s is made to be added to %s: all but its errors is counted on the sum of both\n", e.name.c_str(),
                  e.counted_with.c_str());
  if (!evaluation.region_names.empty()) {
    std::puts("by region, relative error over all expressions; crossing pairs of the result / expected:");
    for (std::size_t r = 0; r < evaluation.region_names.size(); ++r) {
      double error2 = 0, expected2 = 0;
      std::size_t result_crossings = 0, expected_crossings = 0;
      for (const transfer::ExpressionEvaluation& e : evaluation.expressions) {
        error2 += e.regions[r].rms * e.regions[r].rms;
        expected2 += e.regions[r].expected_rms * e.regions[r].expected_rms;
        if (e.result_crossings) result_crossings += e.result_crossings->regions[r];
        if (e.expected_crossings) expected_crossings += e.expected_crossings->regions[r];
      }
      if (expected2 > 0 || result_crossings > 0)
        std::printf("  %-18s %8s %6zu/%zu\n", evaluation.region_names[r].c_str(),
                    expected2 > 0 ? fixed4(std::sqrt(error2 / expected2)).c_str() : "", result_crossings,
                    expected_crossings);
    }
  }
  for (const std::string& name : pairs.without_truth) std::printf("no truth for %s\n", name.c_str());
  for (const std::string& name : pairs.without_result) std::printf("no result for %s\n", name.c_str());
}

int run(const Options& options) {
  requireReadable(options.neutral);
  if (!options.picture.empty()) requireReplaceable(options.picture);
  for (const std::string& folder : {options.results, options.truth})
    if (!folder.empty() && !std::filesystem::is_directory(folder)) throw CommandError(kNoInput, folder + ": no such folder of meshes");
  const rig::Mesh neutral = rig::readMesh(options.neutral);
  rig::VertexPositions truth_neutral = neutral.positions;
  if (!options.truth_neutral.empty()) {
    requireReadable(options.truth_neutral);
    const rig::Mesh other = rig::readMesh(options.truth_neutral);
    rig::requireSameTopology(neutral, other, options.truth_neutral);
    truth_neutral = other.positions;
  }
  transfer::EvaluationScope scope;
  parseRange(options.vertices, scope);
  if (scope.first_vertex >= neutral.vertexCount())
    throw CommandError(kWrongUsage, "--vertices " + options.vertices + ": " + options.neutral + " has " +
                                        std::to_string(neutral.vertexCount()) + " vertices");
  std::optional<double> eye_separation;
  Eigen::Matrix3d mesh_from_head = Eigen::Matrix3d::Identity();
  rig::Contacts contacts;
  if (!options.rig.empty()) {
    requireReadable(options.rig);
    const rig::Rig rig = rig::readRig(options.rig);
    if (rig.neutral.vertexCount() != neutral.vertexCount())
      throw CommandError(kBadData, options.rig + ": its mesh has " + std::to_string(rig.neutral.vertexCount()) +
                                       " vertices, " + options.neutral + " has " +
                                       std::to_string(neutral.vertexCount()) + "; give the rig of that mesh");
    nameRegions(rig, scope);
    eye_separation = rig.fapu.fapu.eye_separation;
    contacts = rig.contacts;
    scope.contacts = &contacts;
    scope.eye_separation = rig.fapu.fapu.eye_separation;
    mesh_from_head = rig.mesh_from_head;
  }
  transfer::MeshSet results = transfer::readMeshSet(options.results, neutral);
  transfer::MeshSet truths;
  if (options.truth.empty()) {
    truths.names = results.names;
    truths.positions.assign(results.size(), truth_neutral);
  } else {
    truths = transfer::readMeshSet(options.truth, neutral);
  }
  const Pairs pairs = pairUp(std::move(results), std::move(truths));
  if (pairs.names.empty())
    throw CommandError(kBadData, options.results + " and " + options.truth + ": no file name is in both folders");
  const transfer::Evaluation evaluation =
      transfer::evaluate(neutral, truth_neutral, pairs.names, pairs.results, pairs.truths, scope);
  if (!options.picture.empty()) {
    double full_scale = options.full_scale;
    if (full_scale <= 0)
      full_scale =
          0.1 * eye_separation.value_or(
                    (neutral.positions.colwise().maxCoeff() - neutral.positions.colwise().minCoeff()).norm() / 5);
    picture::writePng(options.picture, errorSheet(neutral, truth_neutral, evaluation, pairs.results, pairs.truths,
                                                  full_scale, mesh_from_head));
  }
  if (options.json)
    printJson(evaluation, pairs, eye_separation);
  else
    printTable(evaluation, pairs, eye_separation);
  return kDone;
}

}  // namespace

RunVerb defineEvaluate(CLI::App& app) {
  auto options = std::make_shared<Options>();
  app.add_option("results", options->results, "folder of the meshes to judge")->required()->type_name("DIR");
  app.add_option("--truth", options->truth,
                 "folder of the meshes they should be, same file names; without it they are compared with the face at "
                 "rest: what turned over, what goes through itself, and how far it moved")
      ->type_name("DIR");
  app.add_option("--neutral", options->neutral, "the face at rest that the results belong to")
      ->required()
      ->type_name("MESH");
  app.add_option("--truth-neutral", options->truth_neutral,
                 "the truth's own face at rest, where it is another person's: its displacements are what is expected")
      ->type_name("MESH");
  app.add_option("--rig", options->rig, "a rig of the neutral mesh: errors by region, and against the eye separation")
      ->type_name("C.rig");
  app.add_option("--vertices", options->vertices, "judge these vertices only: FIRST-LAST, from 0")->type_name("A-B");
  app.add_option("--picture", options->picture, "a sheet with the error in colour")->type_name("F.png");
  app.add_option("--full-scale", options->full_scale,
                 "error that is drawn red, mesh unit (default: a tenth of the eye separation)")
      ->check(CLI::PositiveNumber);
  app.add_flag("--json", options->json, "for programs");
  return [options] { return run(*options); };
}

}  // namespace volto::cli
