// Accuracy on the public takes with known truth, from the pixels alone. The bounds are a little looser than what was
// measured.
#include <charconv>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <numbers>

#include <gtest/gtest.h>

#include "capture/openface_csv.h"
#include "tests/support/test_data.h"
#include "tracker/tracker.h"

// The figures are the same with sanitizers, only minutes later.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define VOLTO_SKIP_WHEN_SANITIZED() GTEST_SKIP() << "SKIPPED: accuracy is measured in the normal build"
#else
#define VOLTO_SKIP_WHEN_SANITIZED() static_cast<void>(0)
#endif

namespace volto::tracker {
namespace {

using Weights = Eigen::Matrix<double, 52, 1>;
using Energy = Eigen::Matrix<double, 52, 52>;

std::string textOf(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

// Positions of an OBJ's first vertices: the narrow face.
Eigen::VectorXd faceVertices(const std::filesystem::path& path) {
  constexpr Eigen::Index kVertices = 6706;
  const std::string text = textOf(path);
  Eigen::VectorXd positions(3 * kVertices);
  Eigen::Index next = 0;
  const char* at = text.data();
  const char* const end = at + text.size();
  while (at < end && next < positions.size()) {
    if (at + 2 < end && at[0] == 'v' && at[1] == ' ') {
      at += 2;
      for (int c = 0; c < 3; ++c) {
        while (at < end && *at == ' ') ++at;
        at = std::from_chars(at, end, positions[next++]).ptr;
      }
    }
    while (at < end && *at != '\n') ++at;
    ++at;
  }
  EXPECT_EQ(next, positions.size()) << path;
  return positions;
}

// e^T G e: how far a difference of weights moves the face, summed over its vertices.
const Energy& faceEnergy(const std::filesystem::path& data) {
  static const Energy energy = [&] {
    const std::filesystem::path ict = data / "meshes" / "ict";
    const Eigen::VectorXd neutral = faceVertices(ict / "neutral.obj");
    Eigen::MatrixXd deltas = Eigen::MatrixXd::Zero(neutral.size(), 52);
    for (int k = 0; k < 52; ++k) {
      const std::string name(kArkitBlendshapeNames[static_cast<std::size_t>(k)]);
      std::vector<std::string> files{name};
      if (name == "browInnerUp" || name == "cheekPuff") files = {name + "_L", name + "_R"};
      const bool mid = name.starts_with("jaw") || name == "mouthLeft" || name == "mouthRight";
      if (!mid && name.ends_with("Left")) files = {name.substr(0, name.size() - 4) + "_L"};
      if (!mid && name.ends_with("Right")) files = {name.substr(0, name.size() - 5) + "_R"};
      for (const std::string& file : files) {
        const std::filesystem::path path = ict / "expressions" / (file + ".obj");
        if (std::filesystem::exists(path)) deltas.col(k) += faceVertices(path) - neutral;
      }
    }
    return Energy(deltas.transpose() * deltas);
  }();
  return energy;
}

struct Truth {
  std::vector<Weights> weights;
  std::vector<std::array<double, 3>> head_deg;
};

Truth readTruth(const std::filesystem::path& path) {
  Truth truth;
  std::ifstream file(path);
  std::string line;
  std::getline(file, line);  // timestamp, 52 names in Live Link order, headYaw, headPitch, headRoll
  while (std::getline(file, line)) {
    std::vector<double> values;
    for (const char *at = line.data(), *end = at + line.size(); at < end;) {
      double v = 0;
      at = std::from_chars(at, end, v).ptr + 1;
      values.push_back(v);
    }
    if (values.size() < 56) break;
    truth.weights.push_back(Eigen::Map<const Weights>(values.data() + 1));
    truth.head_deg.push_back({values[53], values[54], values[55]});
  }
  return truth;
}

struct Score {
  double face_error = 0, worst_head_deg = 0, correlation = 0;
};

Score score(const std::vector<MaskFrame>& masks, const Truth& truth, const Energy& energy) {
  Score s;
  const std::size_t n = std::min(masks.size(), truth.weights.size());
  double wrong = 0, all = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const Weights w = Eigen::Map<const Eigen::Matrix<float, 52, 1>>(masks[i].arkit_weights.data()).cast<double>();
    const Weights e = w - truth.weights[i];
    wrong += e.dot(energy * e);
    all += truth.weights[i].dot(energy * truth.weights[i]);
  }
  s.face_error = std::sqrt(wrong / all);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto angle = [&](std::size_t i) {
      const HeadPose& h = masks[i].head;
      return (axis == 0 ? h.yaw_rad : axis == 1 ? h.pitch_rad : h.roll_rad) * 180 / std::numbers::pi;
    };
    double mean = 0, error = 0;
    for (std::size_t i = 0; i < n; ++i) mean += (angle(i) - truth.head_deg[i][axis]) / static_cast<double>(n);
    for (std::size_t i = 0; i < n; ++i)
      error += std::abs(angle(i) - truth.head_deg[i][axis] - mean) / static_cast<double>(n);
    s.worst_head_deg = std::max(s.worst_head_deg, error);
  }
  int active = 0;
  for (int k = 0; k < 52; ++k) {
    double low = 1, high = 0, mw = 0, mt = 0, ww = 0, tt = 0, wt = 0;
    for (std::size_t i = 0; i < n; ++i) {
      const double t = truth.weights[i][k], w = masks[i].arkit_weights[static_cast<std::size_t>(k)];
      low = std::min(low, t);
      high = std::max(high, t);
      mw += w / static_cast<double>(n);
      mt += t / static_cast<double>(n);
    }
    if (high - low <= 0.2) continue;
    ++active;
    for (std::size_t i = 0; i < n; ++i) {
      const double t = truth.weights[i][k] - mt, w = masks[i].arkit_weights[static_cast<std::size_t>(k)] - mw;
      ww += w * w;
      tt += t * t;
      wt += w * t;
    }
    if (ww > 1e-12) s.correlation += wt / std::sqrt(ww * tt);
  }
  s.correlation /= std::max(active, 1);
  return s;
}

constexpr std::array<const char*, 4> kTakes = {"talking_person_b_30fps", "angry_person_a_60fps",
                                               "fearful_person_b_30fps", "speech_generic_60fps_clean"};

// What the tracker is told of the actor's neutral.
enum class Told { nothing_but_the_whole_take, nothing_live, a_second_of_rest };

std::vector<Score> scores(const std::filesystem::path& data, Told told) {
  const std::filesystem::path takes = data / "takes" / "synthetic";
  std::vector<Score> all;
  for (const std::string take : kTakes) {
    const auto recording = capture::readOpenFaceCsv(takes / (take + ".openface.csv"));
    const TrackerOptions options{.use_3d = false};
    Tracker tracker(options);
    if (told == Told::nothing_but_the_whole_take) tracker.setNeutral(neutralFromTake(recording.frames, options));
    if (told == Told::a_second_of_rest)
      tracker.setNeutral(
          neutralFromRest(capture::readOpenFaceCsv(takes / (take + ".neutral.openface.csv")).frames, options));
    std::vector<MaskFrame> masks(recording.frames.size());
    for (std::size_t i = 0; i < masks.size(); ++i) tracker.push(recording.frames[i], masks[i]);
    all.push_back(score(masks, readTruth(takes / (take + ".truth.csv")), faceEnergy(data)));
    const Score& s = all.back();
    std::printf("%-28s face error %.3f  correlation %.2f  head %.2f deg\n", take.c_str(), s.face_error, s.correlation,
                s.worst_head_deg);
  }
  return all;
}

void expectWithin(const std::vector<Score>& all, double mean_error, double worst_error, double correlation) {
  double error = 0, together = 0;
  for (const Score& s : all) {
    error += s.face_error / static_cast<double>(all.size());
    together += s.correlation / static_cast<double>(all.size());
    EXPECT_LT(s.face_error, worst_error);
    EXPECT_LT(s.worst_head_deg, 0.8);
  }
  EXPECT_LT(error, mean_error);
  EXPECT_GT(together, correlation);
}

TEST(Accuracy, ToldNothingButTheWholeTake) {
  VOLTO_SKIP_WHEN_SANITIZED();
  VOLTO_REQUIRE_DATA(data);
  expectWithin(scores(data, Told::nothing_but_the_whole_take), 0.38, 0.5, 0.77);
}

TEST(Accuracy, ToldNothingLive) {
  VOLTO_SKIP_WHEN_SANITIZED();
  VOLTO_REQUIRE_DATA(data);
  expectWithin(scores(data, Told::nothing_live), 0.45, 0.65, 0.67);
}

TEST(Accuracy, ToldASecondOfRest) {
  VOLTO_SKIP_WHEN_SANITIZED();
  VOLTO_REQUIRE_DATA(data);
  expectWithin(scores(data, Told::a_second_of_rest), 0.25, 0.37, 0.79);
}

}  // namespace
}  // namespace volto::tracker
