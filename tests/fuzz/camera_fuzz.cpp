// Any troubles at any time befall a camera: nothing hangs, nothing is left open or mapped, and when all is well again
// pictures come. Each two bytes are a moment and a line of the script.
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>

#include "tests/capture/fake/troubles.h"
#include "tests/capture/v4l2/camera_stage.h"

using namespace volto;
using namespace volto::capture;

namespace {

void require(bool holds, const std::string& script) {
  if (holds) return;
  std::fputs(script.c_str(), stderr);
  std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr std::size_t kMostFaults = 12;
  if (size < 1) return 0;
  std::string script = data[0] % 2 == 0 ? "formats YUYV 64x48@30\n" : "formats MJPG 64x48@30\n";
  for (std::size_t i = 1; i + 1 < size && i < 2 * kMostFaults; i += 2)
    script += "at " + std::to_string(data[i] % 200) + " " +
              std::string(fake::kTroubles[data[i + 1] % fake::kTroubles.size()]) + "\n";
  Stage stage(script);
  const std::int64_t deadline = stage.system.nowNs() + 8 * kSecond;
  while (stage.system.nowNs() < deadline) {
    const std::int64_t before = stage.system.nowNs();
    stage.next(200);
    require(stage.system.nowNs() - before <= 2 * kSecond, script);
  }
  stage.system.world().endScript();
  stage.system.world().apply("ok");
  if (stage.camera().spec.number < 0) stage.system.world().apply("replug as video0");
  require(stage.untilState(SourceState::streaming, 20) <= 15, script);
  require(stage.take(10) == 10, script);
  stage.source.reset();
  require(stage.system.world().openFiles() == 0 && stage.system.world().liveMaps() == 0, script);
  return 0;
}
