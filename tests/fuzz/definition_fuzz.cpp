// Any bytes, taken for a rig definition: refused with one line that names the file, or a definition that is the same
// after it was written and read again, and that a mesh either fits or is refused for.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include "rig/rig_definition.h"

using namespace volto;
using namespace volto::rig;

namespace {

void require(bool holds) {
  if (!holds) std::abort();
}

void requireOneLine(const InputError& error, std::string_view start) {
  const std::string_view text = error.what();
  require(text.starts_with(start) && text.find('\n') == std::string_view::npos && text.size() < 600);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  RigDefinition definition;
  try {
    definition = parseRigDefinition({reinterpret_cast<const char*>(data), size}, "r.json");
  } catch (const InputError& error) {
    requireOneLine(error, "r.json");
    return 0;
  }
  for (const auto& [point, choice] : definition.points) {
    require(point < kFeaturePointCount);
    if (const auto* position = std::get_if<Eigen::Vector3d>(&choice)) require(position->allFinite());
  }
  RigOptions options;
  definition.applyTo(options);
  require(std::isfinite(options.fade_out_es) && std::isfinite(options.blend_width));

  const std::string written = formatRigDefinition(definition);
  require(formatRigDefinition(parseRigDefinition(written, "again.json")) == written);

  Mesh mesh;
  mesh.positions = VertexPositions::Zero(100, 3);
  mesh.polygon_start = {0, 3};
  mesh.corner_vertices = {0, 1, 2};
  try {
    definition.check(mesh);
  } catch (const InputError& error) {
    requireOneLine(error, "");
  }
  return 0;
}
