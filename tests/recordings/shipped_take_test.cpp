// The data that is shipped: is it what the manifest says, and what its generator makes?
#include "recordings/make/shipped_take.h"

#include <cmath>
#include <fstream>
#include <iterator>
#include <set>
#include <sstream>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "capture/sha256.h"
#include "protocol/take_reader.h"
#include "recordings/make/person.h"
#include "tests/support/test_data.h"

namespace volto::recordings {
namespace {

std::filesystem::path shipped() { return test::sourceDir() / "recordings"; }

std::string contents(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  EXPECT_TRUE(file.good()) << path;
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

std::vector<LandmarkFrame> framesOf(const std::filesystem::path& take) {
  protocol::TakeReader reader(take.string());
  std::vector<LandmarkFrame> out;
  protocol::LandmarkMessage message;
  while (reader.next(message)) out.push_back(message.frame);
  EXPECT_TRUE(reader.finished());
  EXPECT_FALSE(reader.counters().damaged());
  return out;
}

TEST(Sha256, AgreesWithTheStandardsExamples) {
  EXPECT_EQ(capture::sha256Hex(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(capture::sha256Hex("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(capture::sha256Hex("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"),
            "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
  EXPECT_EQ(capture::sha256Hex(std::string(1000000, 'a')),
            "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

TEST(ShippedTake, EveryFileIsInTheManifestAndIsWhatItSays) {
  const auto manifest = nlohmann::json::parse(contents(shipped() / "manifest.json"));
  std::set<std::string> listed{"manifest.json", "README.md", "CMakeLists.txt", "make"};
  for (const auto& entry : manifest.at("files")) {
    const std::string file = entry.at("file");
    const std::string bytes = contents(shipped() / file);
    EXPECT_EQ(capture::sha256Hex(bytes), entry.at("sha256")) << file;
    EXPECT_EQ(bytes.size(), entry.at("bytes")) << file;
    for (const char* key : {"what", "whence", "licence"})
      EXPECT_FALSE(entry.at(key).get<std::string>().empty()) << file << " " << key;
    listed.insert(file);
  }
  for (const auto& found : std::filesystem::directory_iterator(shipped())) {
    EXPECT_TRUE(listed.contains(found.path().filename().string())) << found.path() << " is not in the manifest";
  }
}

TEST(ShippedTake, IsHalfAMinuteOfWellFormedFrames) {
  const std::vector<LandmarkFrame> frames = framesOf(shipped() / "volto_take.take");
  ASSERT_EQ(frames.size(), 2160U);
  const double seconds = static_cast<double>(frames.back().t_capture_ns - frames.front().t_capture_ns) * 1e-9;
  EXPECT_NEAR(seconds, 36.0 - 1.0 / 60.0, 1e-6);
  EXPECT_LE(std::filesystem::file_size(shipped() / "volto_take.take"), 2'000'000U);
  std::size_t lost = 0;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const LandmarkFrame& frame = frames[i];
    EXPECT_EQ(frame.capture_seq, i + 1);
    if (i > 0) {
      EXPECT_GT(frame.t_capture_ns, frames[i - 1].t_capture_ns);
    }
    EXPECT_EQ(frame.layout, LandmarkLayout::ibug68);
    if (!frame.face_present) {
      ++lost;
      continue;
    }
    ASSERT_EQ(frame.points_px.size(), 68U);
    for (const auto& p : frame.points_px) {
      ASSERT_TRUE(p[0] > 0 && p[0] < 640 && p[1] > 0 && p[1] < 480) << "frame " << i << " leaves the image";
    }
    EXPECT_GT(frame.confidence, 0.3F);
  }
  EXPECT_EQ(lost, 21U) << "a hand before the face";
}

TEST(ShippedTake, TruthHasARowForEveryFrame) {
  std::istringstream csv(contents(shipped() / "volto_take.truth.csv"));
  std::string line;
  std::getline(csv, line);
  EXPECT_TRUE(line.starts_with("timestamp,eyeBlinkLeft,")) << line;
  EXPECT_TRUE(line.ends_with(",headYaw,headPitch,headRoll")) << line;
  std::size_t rows = 0;
  while (std::getline(csv, line)) {
    ++rows;
    ASSERT_EQ(std::count(line.begin(), line.end(), ','), 55) << line;
  }
  EXPECT_EQ(rows, 2160U);
}

TEST(ShippedTake, ComesOutOfItsGeneratorToTheByte) {
  const auto manifest = nlohmann::json::parse(contents(shipped() / "manifest.json"));
  if (manifest.at("made_from") != Person().digest()) {
    GTEST_SKIP() << "SKIPPED: the expression table or the reference mask is another than the take was made from; "
                    "`volto-make-take recordings` makes it anew";
  }
  const test::TemporaryDir made;
  writeShippedTake(makeShippedTake(), made.path());
  EXPECT_EQ(contents(made / "volto_take.truth.csv"), contents(shipped() / "volto_take.truth.csv"));
  std::string ours = contents(made / "volto_take.take"), theirs = contents(shipped() / "volto_take.take");
  ASSERT_EQ(ours.size(), theirs.size());
  // SQLite writes its own version number at byte 96.
  for (std::string* bytes : {&ours, &theirs}) bytes->replace(96, 4, 4, '\0');
  EXPECT_TRUE(ours == theirs);
}

TEST(Performance, IsAlive) {
  const Performance performance(kShippedSeed);
  const auto reach = [&](const char* name) {
    float least = 1, most = 0;
    for (int i = 0; i < 36 * 60; ++i) {
      const float w = performance.at(i / 60.0).weights[*arkitBlendshapeIndex(name)];
      least = std::min(least, w);
      most = std::max(most, w);
    }
    return most - least;
  };
  for (const char* name : {"jawOpen", "eyeBlinkLeft", "eyeBlinkRight", "mouthSmileLeft", "mouthPucker", "browInnerUp",
                           "browDownLeft", "eyeWideLeft"}) {
    EXPECT_GT(reach(name), 0.5F) << name;
  }
  int blinks = 0;
  bool closed = false;
  for (int i = 0; i < 36 * 60; ++i) {
    const bool now = performance.at(i / 60.0).weights[*arkitBlendshapeIndex("eyeBlinkLeft")] > 0.6F;
    blinks += now && !closed ? 1 : 0;
    closed = now;
  }
  EXPECT_GE(blinks, 9);
  EXPECT_LE(blinks, 24);
}

TEST(Performance, NothingJumps) {
  const Performance performance(kShippedSeed);
  Moment before = performance.at(0);
  for (int i = 1; i < 36 * 240; ++i) {
    const Moment now = performance.at(i / 240.0);
    for (std::size_t k = 0; k < kArkitBlendshapeCount; ++k) {
      ASSERT_LT(std::abs(now.weights[k] - before.weights[k]), 0.13F) << kArkitBlendshapeNames[k] << " at " << i / 240.0;
    }
    ASSERT_LT(std::abs(now.yaw_rad - before.yaw_rad), 0.01);
    before = now;
  }
}

TEST(Person, LipsMeetAtRestAndThePersonIsNotTheReference) {
  const Person person;
  const auto rest = person.landmarks(ArkitWeights{});
  EXPECT_LT((rest[62] - rest[66]).norm(), 4.0);
  ArkitWeights open{};
  open[*arkitBlendshapeIndex("jawOpen")] = 1.0F;
  const auto opened = person.landmarks(open);
  EXPECT_GT((opened[62] - opened[66]).norm(), 15.0);
  EXPECT_LT((opened[27] - rest[27]).norm(), 2.0) << "the nose stays";
  for (const auto& p : opened) EXPECT_TRUE(p.allFinite());
}

}  // namespace
}  // namespace volto::recordings
