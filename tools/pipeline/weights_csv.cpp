#include "tools/pipeline/weights_csv.h"

#include <array>
#include <charconv>
#include <numbers>

#include "rig/feature_points.h"

namespace volto::pipeline {

namespace {

void appendFixed(std::string& out, double value, int decimals) {
  std::array<char, 64> text;
  const auto result = std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::fixed, decimals);
  std::string_view digits(text.data(), static_cast<std::size_t>(result.ptr - text.data()));
  // "-0.000000" is zero too.
  if (digits.starts_with('-') && digits.find_first_not_of("-0.") == std::string_view::npos) digits.remove_prefix(1);
  out += digits;
}

}  // namespace

void appendSeconds(std::string& out, std::int64_t t_ns) {
  std::uint64_t magnitude = static_cast<std::uint64_t>(t_ns);
  if (t_ns < 0) {
    out += '-';
    magnitude = 0 - magnitude;
  }
  std::array<char, 24> text;
  const auto whole = std::to_chars(text.data(), text.data() + text.size(), magnitude / 1'000'000'000);
  out.append(text.data(), whole.ptr);
  out += '.';
  std::uint64_t rest = magnitude % 1'000'000'000;
  std::uint64_t place = 100'000'000;
  for (int digit = 0; digit < 9 && (digit < 4 || rest > 0); ++digit, place /= 10) {
    out += static_cast<char>('0' + rest / place);
    rest %= place;
  }
}

void appendWeightsHeader(std::string& out, std::span<const std::string> names) {
  out += "timestamp";
  for (const std::string& name : names) (out += ',') += name;
  out += ",headYaw,headPitch,headRoll\n";
}

void appendWeightsRow(std::string& out, std::int64_t t_ns, std::span<const float> weights,
                      std::span<const std::uint8_t> observed, const HeadPose& head) {
  appendSeconds(out, t_ns);
  for (std::size_t i = 0; i < weights.size(); ++i) {
    out += ',';
    if (observed[i] != 0) appendFixed(out, static_cast<double>(weights[i]), 6);
  }
  for (const float angle_rad : {head.yaw_rad, head.pitch_rad, head.roll_rad}) {
    out += ',';
    if (head.observed) appendFixed(out, static_cast<double>(angle_rad) * 180.0 / std::numbers::pi, 4);
  }
  out += '\n';
}

void appendMaskHeader(std::string& out) {
  out += "timestamp";
  for (const rig::FeaturePoint& point : rig::featurePoints()) {
    for (const char* axis : {"_x", "_y", "_z"}) ((out += ',') += point.id) += axis;
  }
  out += '\n';
}

void appendMaskRow(std::string& out, const MaskFrame& mask) {
  appendSeconds(out, mask.t_capture_ns);
  for (std::size_t i = 0; i < kFeaturePointCount; ++i) {
    for (const float value : mask.displacement_fapu[i]) {
      out += ',';
      if (mask.point_confidence[i] > 0) appendFixed(out, static_cast<double>(value), 6);
    }
  }
  out += '\n';
}

}  // namespace volto::pipeline
