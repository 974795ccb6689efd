#include "recordings/make/shipped_take.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <numbers>
#include <stdexcept>

#include <Eigen/Geometry>

#include "capture/sha256.h"
#include "protocol/take_writer.h"
#include "recordings/make/person.h"

namespace volto::recordings {
namespace {

constexpr double kWhiteNoisePx = 0.25;  // deviation, new in every frame
constexpr double kSlowNoisePx = 0.18;   // deviation, drifting from frame to frame
constexpr double kSlowNoiseMemory = 0.8;
constexpr std::int64_t kStartRealtimeNs =
    1717761600LL * 1'000'000'000LL;  // 2024-06-07 12:00:00 UTC: not read from a clock

double rounded(double px) { return std::round(px * 256.0) / 256.0; }

// Image of a point of the head, pixels.
Eigen::Vector2d project(const Moment& moment, const Eigen::Vector3d& head_mm) {
  const Eigen::Matrix3d turned = (Eigen::AngleAxisd(moment.yaw_rad, Eigen::Vector3d::UnitY()) *
                                  Eigen::AngleAxisd(moment.pitch_rad, Eigen::Vector3d::UnitX()) *
                                  Eigen::AngleAxisd(moment.roll_rad, Eigen::Vector3d::UnitZ()))
                                     .toRotationMatrix();
  const Eigen::Vector3d p = turned * head_mm;
  // Camera frame: x right (the subject's left), y down, z away.
  const Eigen::Vector3d camera(moment.head_mm[0] + p.x(), moment.head_mm[1] - p.y(), moment.head_mm[2] - p.z());
  return {0.5 * kImageWidthPx + kFocalLengthPx * camera.x() / camera.z(),
          0.5 * kImageHeightPx + kFocalLengthPx * camera.y() / camera.z()};
}

// What a landmark detector adds.
class DetectorNoise {
 public:
  explicit DetectorNoise(std::uint64_t seed) : random_(seed) {
    for (auto& point : slow_) point = {random_.normal(), random_.normal()};
  }
  // The less confident, the noisier.
  void add(double confidence, std::vector<std::array<float, 2>>& points) {
    const double factor = 1.0 + 4.0 * std::max(0.0, 0.95 - confidence);
    for (std::size_t i = 0; i < points.size(); ++i) {
      for (std::size_t axis = 0; axis < 2; ++axis) {
        double& slow = slow_[i][axis];
        slow = kSlowNoiseMemory * slow + std::sqrt(1.0 - kSlowNoiseMemory * kSlowNoiseMemory) * random_.normal();
        const double noise = factor * (kWhiteNoisePx * random_.normal() + kSlowNoisePx * slow);
        points[i][axis] = static_cast<float>(rounded(static_cast<double>(points[i][axis]) + noise));
      }
    }
  }

 private:
  Random random_;
  std::array<std::array<double, 2>, kLandmarks> slow_;
};

void appendFixed(double value, int decimals, std::string& out) {
  const double unit = std::pow(10.0, decimals);
  const long long scaled = std::llround(value * unit);
  if (scaled == 0) {
    out += '0';
    return;
  }
  char text[40];
  std::snprintf(text, sizeof text, "%.*f", decimals, static_cast<double>(scaled) / unit);
  std::string trimmed = text;
  trimmed.erase(trimmed.find_last_not_of('0') + 1);
  if (trimmed.back() == '.') trimmed.pop_back();
  out += trimmed;
}

void writeWhole(const std::filesystem::path& path, const std::string& text) {
  std::ofstream file(path, std::ios::binary);
  file << text;
  file.close();
  if (!file) throw std::runtime_error(path.string() + ": cannot be written");
}

std::string readWhole(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::string text((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  if (!file) throw std::runtime_error(path.string() + ": cannot be read");
  return text;
}

void writeTake(const ShippedTake& take, const std::filesystem::path& path) {
  protocol::TakeHeader header;
  header.name = "volto_take";
  header.source = "volto-make-take";
  header.layout = "ibug68";
  header.actor = "nobody: a synthetic face";
  header.note =
      "Apache-2.0. Speech, blinks, brows, smiles, head turns; a hand before the face at 21.9 s. Made, not recorded.";
  header.program = "volto-make-take 1";
  header.start_realtime_ns = kStartRealtimeNs;
  protocol::TakeWriterOptions options;
  options.force = true;
  options.reproducible = true;
  protocol::TakeWriter writer(path.string(), header, options);
  for (const LandmarkFrame& frame : take.frames) {
    if (const protocol::Result result = writer.append(frame, "volto_take"); !result) {
      throw std::runtime_error(path.string() + ": " + result.problem);
    }
  }
  if (const protocol::Result result = writer.finish(); !result)
    throw std::runtime_error(path.string() + ": " + result.problem);
}

constexpr const char* kMade = "made by recordings/make (volto-make-take); no recording of a person is behind it";

std::string manifestEntry(const std::filesystem::path& folder, const std::string& file, const std::string& what,
                          const std::string& whence) {
  const std::string bytes = readWhole(folder / file);
  return "    {\n      \"file\": \"" + file + "\",\n      \"what\": \"" + what + "\",\n      \"whence\": \"" + whence +
         "\",\n      \"licence\": \"Apache-2.0\",\n      \"bytes\": " + std::to_string(bytes.size()) +
         ",\n      \"sha256\": \"" + capture::sha256Hex(bytes) + "\"\n    }";
}

}  // namespace

ShippedTake makeShippedTake() {
  const Performance performance(kShippedSeed);
  const Person person;
  DetectorNoise noise(kShippedSeed + 1);
  const auto count = static_cast<std::size_t>(std::llround(performance.durationS() * kShippedRateHz));
  ShippedTake take;
  for (std::size_t i = 0; i < count; ++i) {
    const double t_s = static_cast<double>(i) / kShippedRateHz;
    take.truth.push_back(performance.at(t_s));
    const Moment& moment = take.truth.back();
    LandmarkFrame frame;
    frame.t_capture_ns = (static_cast<std::int64_t>(i) * 1'000'000'000 + kShippedRateHz / 2) / kShippedRateHz;
    frame.capture_seq = i + 1;
    frame.face_present = moment.face_present;
    frame.image_width_px = kImageWidthPx;
    frame.image_height_px = kImageHeightPx;
    frame.focal_length_px = kFocalLengthPx;
    frame.confidence = static_cast<float>(rounded(moment.confidence));
    for (const Eigen::Vector3d& point : person.landmarks(moment.weights)) {
      const Eigen::Vector2d px = project(moment, point);
      frame.points_px.push_back({static_cast<float>(px.x()), static_cast<float>(px.y())});
    }
    noise.add(moment.confidence, frame.points_px);
    if (!frame.face_present) frame.points_px.clear();
    take.frames.push_back(std::move(frame));
  }
  return take;
}

std::string truthCsv(const ShippedTake& take) {
  std::string out = "timestamp";
  for (const std::string_view name : kArkitBlendshapeNames) (out += ',') += name;
  out += ",headYaw,headPitch,headRoll\n";
  constexpr double kDegrees = 180.0 / std::numbers::pi;
  for (std::size_t i = 0; i < take.truth.size(); ++i) {
    const Moment& moment = take.truth[i];
    appendFixed(static_cast<double>(take.frames[i].t_capture_ns) * 1e-9, 4, out);
    for (const float weight : moment.weights) {
      out += ',';
      appendFixed(static_cast<double>(weight), 3, out);
    }
    for (const double angle_rad : {moment.yaw_rad, moment.pitch_rad, moment.roll_rad}) {
      out += ',';
      appendFixed(angle_rad * kDegrees, 2, out);
    }
    out += '\n';
  }
  return out;
}

void writeShippedTake(const ShippedTake& take, const std::filesystem::path& folder) {
  writeTake(take, folder / "volto_take.take");
  writeWhole(folder / "volto_take.truth.csv", truthCsv(take));
  std::string manifest = "{\n  \"made_from\": \"" + Person().digest() + "\",\n  \"files\": [\n";
  manifest += manifestEntry(folder, "volto_take.take",
                            "36 s at 60 frames a second: a face speaks, blinks, smiles, frowns and turns its head; 68 "
                            "iBUG landmarks in pixels with camera noise",
                            kMade) +
              ",\n";
  manifest += manifestEntry(folder, "volto_take.truth.csv",
                            "the ARKit weights and head angles behind it, one row per frame", kMade);
  // Measured, not made: it is there or not, and stays as it is.
  if (std::filesystem::exists(folder / "talking.take")) {
    manifest +=
        ",\n" + manifestEntry(folder, "talking.take",
                              "8 s at 25 frames a second: a person speaks to a camera, seen by YuNet and PFLD; 68 "
                              "iBUG landmarks and pupils in pixels with a real detector's noise and bias; no truth",
                              "numbers measured by volto run on the talking test clip of the SadTalker project "
                              "(talking_512x512_25fps.mp4); no picture of it");
  }
  manifest += "\n  ]\n}\n";
  writeWhole(folder / "manifest.json", manifest);
}

}  // namespace volto::recordings
