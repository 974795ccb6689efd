#include "tools/export/livelink_csv.h"

#include <array>
#include <charconv>

#include "frames/arkit_blendshapes.h"
#include "rig/errors.h"

namespace volto::exporter {
namespace {

constexpr std::array<const char*, 9> kAngleNames = {"HeadYaw",     "HeadPitch",     "HeadRoll",
                                                    "LeftEyeYaw",  "LeftEyePitch",  "LeftEyeRoll",
                                                    "RightEyeYaw", "RightEyePitch", "RightEyeRoll"};

void appendDecimals(std::string& out, float value) {
  std::array<char, 64> text;
  const double written = value == 0.0F ? 0.0 : static_cast<double>(value);  // no -0
  const auto end = std::to_chars(text.data(), text.data() + text.size(), written, std::chars_format::fixed, 10).ptr;
  out.append(text.data(), end);
}

void appendDigits(std::string& out, std::int64_t value, std::size_t width) {
  const std::string digits = std::to_string(value);
  out.append(width > digits.size() ? width - digits.size() : 0, '0');
  out += digits;
}

void appendTimecode(std::string& out, std::int64_t t_ns) {
  constexpr std::int64_t kDay = std::int64_t{24} * 3600 * 60'000;  // thousandths of a frame
  // 60 000 of them a second: ns * 6 / 100 000, rounded, in steps that do not overflow.
  const std::int64_t seconds = t_ns / 1'000'000'000, rest = t_ns % 1'000'000'000;
  std::int64_t units = seconds % 86'400 * 60'000 + (rest * 6 + (rest < 0 ? -50'000 : 50'000)) / 100'000;
  units = ((units % kDay) + kDay) % kDay;
  appendDigits(out, units / (3600 * 60'000), 2);
  appendDigits(out += ':', units / (60 * 60'000) % 60, 2);
  appendDigits(out += ':', units / 60'000 % 60, 2);
  appendDigits(out += ':', units % 60'000 / 1000, 2);
  appendDigits(out += '.', units % 1000, 3);
}

}  // namespace

std::string liveLinkHeader() {
  std::string out = "Timecode,BlendShapeCount";
  for (const std::string_view name : kArkitBlendshapeNames) {
    out += ',';
    out += static_cast<char>(name[0] - 'a' + 'A');
    out += name.substr(1);
  }
  for (const char* name : kAngleNames) (out += ',') += name;
  return out + "\n";
}

LiveLinkRows::LiveLinkRows(const rig::Rig& rig, const rig::ShapeSet* meaning)
    : to_arkit_(rig::blendshapeNames(rig), meaning, *rig::ShapeSet::shipped("arkit")) {}

void LiveLinkRows::append(std::string& out, std::int64_t t_ns, const AvatarFrame& avatar) const {
  appendTimecode(out, t_ns);
  out += ",61";
  std::array<float, kArkitBlendshapeCount> weights{};
  std::array<std::uint8_t, kArkitBlendshapeCount> observed{};
  to_arkit_.apply(avatar.weights, avatar.observed, weights, observed);
  for (const float weight : weights) appendDecimals(out += ',', weight);
  // The phone counts yaw to the subject's right and pitch as Volto's heads do; eyes down.
  std::array<float, 9> angles{};
  if (avatar.head.observed) angles = {-avatar.head.yaw_rad, avatar.head.pitch_rad, avatar.head.roll_rad};
  if (avatar.gaze.confidence > 0.0F) {
    angles[3] = -avatar.gaze.left.yaw_rad;
    angles[4] = -avatar.gaze.left.pitch_rad;
    angles[6] = -avatar.gaze.right.yaw_rad;
    angles[7] = -avatar.gaze.right.pitch_rad;
  }
  for (const float angle : angles) appendDecimals(out += ',', angle);
  out += '\n';
}

}  // namespace volto::exporter
