#include "tools/cli/rig_flags.h"

#include <algorithm>
#include <charconv>

#include "rig/mesh_io.h"
#include "rig/refined_mask.h"
#include "tools/cli/exit_status.h"

namespace volto::cli {

namespace {

constexpr std::size_t kAutomaticPoints = 200;
constexpr std::size_t kMostExamples = 500;

bool parseNumber(std::string_view text, std::size_t most, std::size_t& out) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), out);
  return error == std::errc() && end == text.data() + text.size() && out <= most;
}

}  // namespace

rig::Subdivision parseSubdivision(const std::string& text, bool has_examples) {
  rig::Subdivision out;
  std::size_t number = 0;
  if (text == "auto" || text.starts_with("auto:")) {
    number = kAutomaticPoints;
    if (text != "auto" &&
        (!parseNumber(std::string_view(text).substr(5), rig::kMaxRefinedPoints, number) || number == 0))
      throw CommandError(kWrongUsage, "--subdivide " + text + ": expected auto:POINTS with 1 to " +
                                          std::to_string(rig::kMaxRefinedPoints) + " points");
    if (!has_examples)
      throw CommandError(kWrongUsage, "--subdivide auto needs an example set to choose by: --examples DIR");
    out.budget = number;
    return out;
  }
  if (!parseNumber(text, 6, number))
    throw CommandError(kWrongUsage, "--subdivide " + text + ": expected a number from 0 to 6, or auto[:POINTS]");
  out.levels = static_cast<int>(number);
  return out;
}

std::vector<rig::VertexPositions> readExamples(const std::filesystem::path& folder, const rig::Mesh& neutral) {
  std::error_code error;
  std::vector<std::filesystem::path> files;
  for (std::filesystem::directory_iterator it(folder, error), end; !error && it != end; it.increment(error))
    if (rig::isMeshFileName(it->path())) files.push_back(it->path());
  if (error) throw CommandError(kNoInput, folder.string() + ": cannot be read as a folder: " + error.message());
  if (files.empty()) throw CommandError(kNoInput, folder.string() + ": no meshes in it");
  if (files.size() > kMostExamples)
    throw CommandError(kBadData, folder.string() + ": more than " + std::to_string(kMostExamples) + " meshes");
  std::sort(files.begin(), files.end());
  std::vector<rig::VertexPositions> out;
  for (const auto& file : files) {
    const rig::Mesh mesh = rig::readMesh(file);
    rig::requireSameTopology(neutral, mesh, file.string());
    out.push_back(mesh.positions - neutral.positions);
  }
  return out;
}

}  // namespace volto::cli
