#include "tools/cli/shape_set_flag.h"

#include "tools/cli/exit_status.h"
#include "tools/cli/nearest_match.h"
#include "tools/cli/read_input.h"

namespace volto::cli {
namespace {

constexpr std::size_t kFileLimit = std::size_t{4} << 20;

}  // namespace

bool isShapeSetName(const std::string& text) {
  return rig::ShapeSet::shipped(text) != nullptr || hasExtension(text, ".csv");
}

rig::ShapeSet readShapeSet(const std::string& name_or_file) {
  if (const rig::ShapeSet* set = rig::ShapeSet::shipped(name_or_file)) return *set;
  if (hasExtension(name_or_file, ".csv") || std::filesystem::exists(name_or_file)) {
    requireReadable(name_or_file);
    return rig::ShapeSet::parse(readWhole(name_or_file, kFileLimit), name_or_file, nearestMatch);
  }
  std::vector<std::string> names;
  std::string list;
  for (const rig::ShapeSet& set : rig::ShapeSet::shipped()) {
    names.push_back(set.name());
    list += set.name() + ", ";
  }
  const std::string nearest = nearestMatch(name_or_file, names);
  throw CommandError(kWrongUsage,
                     "there is no set of blendshapes '" + name_or_file + "'; " +
                         (nearest.empty() ? "give " + list + "or a CSV file" : "did you mean " + nearest + "?"));
}

}  // namespace volto::cli
