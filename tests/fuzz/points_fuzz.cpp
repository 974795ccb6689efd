// Any bytes, taken for a feature point file: refused with one line that names the file, or choices of known points with
// finite positions.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "rig/build_rig.h"

using namespace volto;
using namespace volto::rig;

namespace {

void require(bool holds) {
  if (!holds) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    for (const auto& [point, choice] : parseFeaturePoints({reinterpret_cast<const char*>(data), size}, "p.json")) {
      require(point < kFeaturePointCount);
      if (const auto* position = std::get_if<Eigen::Vector3d>(&choice)) require(position->allFinite());
    }
  } catch (const InputError& error) {
    const std::string_view text = error.what();
    require(text.starts_with("p.json") && text.find('\n') == std::string_view::npos && text.size() < 600);
  }
  return 0;
}
