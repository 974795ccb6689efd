// Any bytes, taken for a CSV file: refused with one line that begins with its name, or read; what comes out is finite
// and rises in time.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include "capture/csv_kind.h"
#include "capture/livelink_csv.h"
#include "capture/openface_csv.h"

using namespace volto;
using namespace volto::capture;

namespace {

void require(bool holds) {
  if (!holds) std::abort();
}

void checkComplaint(const InputError& error) {
  const std::string_view text = error.what();
  require(text.starts_with("take.csv:") && text.find('\n') == std::string_view::npos && text.size() < 600);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  csvKind(text);
  try {
    OpenFaceCsvReader reader(text, "take.csv");
    LandmarkFrame frame;
    std::int64_t last_ns = -1;
    while (reader.next(frame)) {
      require(frame.t_capture_ns > last_ns);
      last_ns = frame.t_capture_ns;
      require(frame.face_present ? frame.points_px.size() == 68 : frame.points_px.empty());
      for (const auto& p : frame.points_px) require(std::isfinite(p[0]) && std::isfinite(p[1]));
      for (const auto& p : frame.points_camera_mm)
        require(std::isfinite(p[0]) && std::isfinite(p[1]) && std::isfinite(p[2]));
    }
  } catch (const InputError& error) {
    checkComplaint(error);
  }
  try {
    LiveLinkCsvReader reader(text, "take.csv");
    WeightFrame frame;
    std::int64_t last_ns = -1;
    while (reader.next(frame)) {
      require(frame.t_capture_ns > last_ns);
      last_ns = frame.t_capture_ns;
      for (const float weight : frame.weights) require(weight >= 0.0F && weight <= 1.0F);
    }
  } catch (const InputError& error) {
    checkComplaint(error);
  }
  return 0;
}
