#include "tests/bench/scene.h"

#include <fstream>
#include <iterator>

#include "recordings/make/motion.h"
#include "recordings/make/shipped_take.h"
#include "rig/build_rig.h"
#include "rig/expression_table.h"
#include "rig/mesh_io.h"
#include "tests/support/test_data.h"

namespace volto::bench {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kSpeechStartsAt = 90;  // frames into the shipped take

rig::Rig rigOf(const fs::path& mesh, const fs::path& points) {
  std::ifstream file(points, std::ios::binary);
  const std::string json((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  return rig::buildRig(rig::readMesh(mesh), rig::parseFeaturePoints(json, points.string()));
}

std::vector<std::array<float, 3>> rowsOf(const auto& positions) {
  std::vector<std::array<float, 3>> out;
  for (Eigen::Index i = 0; i < positions.rows(); ++i) {
    out.push_back({static_cast<float>(positions(i, 0)), static_cast<float>(positions(i, 1)),
                   static_cast<float>(positions(i, 2))});
  }
  return out;
}

const recordings::ShippedTake& shippedTake() {
  static const recordings::ShippedTake take = recordings::makeShippedTake();
  return take;
}

}  // namespace

const BenchRig& benchRig() {
  static const BenchRig made = [] {
    const fs::path source = test::sourceDir();
    if (const auto data = test::dataDir(); data && fs::exists(*data / "meshes/ict/neutral.obj")) {
      return BenchRig{rigOf(*data / "meshes/ict/neutral.obj", source / "tests/rig/ict_feature_points.json"),
                      "ICT head"};
    }
    return BenchRig{rigOf(source / "rig/assets/volto_head.obj", source / "rig/assets/volto_head.points.json"),
                    "Volto's head"};
  }();
  return made;
}

std::vector<std::array<float, 3>> neutralVertices(const rig::Rig& rig) { return rowsOf(rig.neutral.positions); }
std::vector<std::array<float, 3>> neutralControls(const rig::Rig& rig) { return rowsOf(rig.feature_positions); }

std::vector<LandmarkFrame> performanceLandmarks(std::size_t count) {
  const auto& frames = shippedTake().frames;
  std::vector<LandmarkFrame> out;
  for (std::size_t i = 0; i < count; ++i) {
    out.push_back(frames[(kSpeechStartsAt + i) % frames.size()]);
    out.back().capture_seq = i + 1;
    out.back().t_capture_ns = static_cast<std::int64_t>(i) * 16'666'667;
  }
  return out;
}

std::vector<MaskFrame> performanceMasks(std::size_t count) {
  const auto& truth = shippedTake().truth;
  recordings::Random random(5);
  std::vector<MaskFrame> out;
  for (std::size_t i = 0; i < count; ++i) {
    MaskFrame frame;
    frame.t_capture_ns = static_cast<std::int64_t>(i) * 16'666'667;
    frame.capture_seq = i + 1;
    frame.state = TrackingState::tracking;
    frame.confidence = 1.0F;
    frame.point_confidence.fill(1.0F);
    rig::ExpressionTable::standard().apply(truth[(kSpeechStartsAt + i) % truth.size()].weights,
                                           frame.displacement_fapu);
    for (auto& point : frame.displacement_fapu) {
      for (float& value : point) value += static_cast<float>(0.01 * random.normal());
    }
    out.push_back(frame);
  }
  return out;
}

}  // namespace volto::bench
