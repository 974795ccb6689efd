// The worked example of protocol/README.md: made by the encoder, read by the decoder, and read by hand from its table
// of bytes.
#include <cstring>
#include <fstream>
#include <sstream>

#include <gtest/gtest.h>

#include "protocol/codec.h"
#include "tests/support/test_data.h"

namespace volto::protocol {
namespace {

std::vector<std::byte> exampleOfReadme() {
  std::ifstream in(::volto::test::sourceDir() / "protocol/README.md");
  std::vector<std::byte> bytes;
  std::string line;
  bool inside = false;
  while (std::getline(in, line)) {
    if (line == "```hex") {
      inside = true;
      continue;
    }
    if (line == "```") inside = false;
    if (!inside) continue;
    std::istringstream words(line);
    std::string word;
    words >> word;
    EXPECT_EQ(std::stoul(word, nullptr, 16), bytes.size());
    while (words >> word) bytes.push_back(static_cast<std::byte>(std::stoul(word, nullptr, 16)));
  }
  return bytes;
}

AvatarFrame exampleFrame() {
  AvatarFrame f;
  f.t_capture_ns = 1'999'000'000;
  f.capture_seq = 120;
  f.state = TrackingState::tracking;
  f.confidence = 0.875F;
  f.head.rotation = {0.0F, 0.6F, 0.0F, 0.8F};
  f.head.yaw_rad = 1.25F;
  f.head.pitch_rad = -0.5F;
  f.head.roll_rad = 0.25F;
  f.head.translation_mm = {1.0F, 2.0F, 512.0F};
  f.head.observed = true;
  f.gaze.left = {0.125F, -0.125F};
  f.gaze.right = {0.0625F, -0.0625F};
  f.gaze.confidence = 1.0F;
  f.weights = {0.5F, 0.25F, 0.0F};
  f.observed = {1, 1, 0};
  return f;
}

TEST(WireTest, ExampleOfTheReadmeIsWhatTheEncoderMakes) {
  Stamp stamp;
  stamp.epoch = 0x1122334455667788ULL;
  stamp.seq = 3;
  stamp.t_publish_ns = 2'000'000'000;
  stamp.t_realtime_ns = 1'700'000'000'000'000'000;
  Encoder encoder;
  ASSERT_TRUE(encoder.encodeWeights(stamp, 0xA1B2C3D4E5F60718ULL, exampleFrame()).ok());
  const std::vector<std::byte> expected = exampleOfReadme();
  ASSERT_EQ(expected.size(), 200U);
  EXPECT_EQ(std::vector<std::byte>(encoder.bytes().begin(), encoder.bytes().end()), expected);
}

TEST(WireTest, ExampleOfTheReadmeIsUnderstood) {
  const std::vector<std::byte> bytes = exampleOfReadme();
  AvatarMessage message;
  const Result r = decodeWeights(bytes, message);
  ASSERT_TRUE(r.ok()) << r.problem;
  EXPECT_EQ(message.stamp.epoch, 0x1122334455667788ULL);
  EXPECT_EQ(message.stamp.seq, 3U);
  EXPECT_EQ(message.stamp.capture_seq, 120U);
  EXPECT_EQ(message.stamp.t_capture_ns, 1'999'000'000);
  EXPECT_EQ(message.character_id, 0xA1B2C3D4E5F60718ULL);
  EXPECT_EQ(message.frame.weights, exampleFrame().weights);
  EXPECT_EQ(message.frame.observed, exampleFrame().observed);
  EXPECT_EQ(message.frame.head.rotation, exampleFrame().head.rotation);
}

template <typename T>
T at(const std::vector<std::byte>& bytes, std::size_t offset) {
  T value{};
  EXPECT_LE(offset + sizeof(T), bytes.size());
  std::memcpy(&value, bytes.data() + offset, sizeof(T));
  return value;
}

TEST(WireTest, TablesOfTheReadmeLeadToEveryField) {
  // With nothing but the page: root, vtable, fields.
  const std::vector<std::byte> b = exampleOfReadme();
  const std::size_t table = at<std::uint32_t>(b, 0);
  const std::size_t vtable = table - static_cast<std::size_t>(at<std::int32_t>(b, table));
  const auto field = [&](std::size_t index) { return table + at<std::uint16_t>(b, vtable + 4 + 2 * index); };
  EXPECT_EQ(at<std::uint64_t>(b, field(0) + 8), 3U) << "seq";
  EXPECT_EQ(at<std::int64_t>(b, field(0) + 24), 1'999'000'000) << "t_capture_ns";
  EXPECT_EQ(at<std::int64_t>(b, field(0) + 32), 2'000'000'000) << "t_publish_ns";
  EXPECT_EQ(at<std::uint64_t>(b, field(1)), 0xA1B2C3D4E5F60718ULL);
  EXPECT_EQ(at<std::uint8_t>(b, field(2)), 1);
  EXPECT_EQ(at<float>(b, field(3)), 0.875F);
  EXPECT_EQ(at<float>(b, field(4) + 12), 0.8F) << "rotation w";
  EXPECT_EQ(at<float>(b, field(4) + 20), -0.5F) << "pitch";
  EXPECT_EQ(at<float>(b, field(4) + 36), 512.0F) << "translation z";
  EXPECT_EQ(at<std::uint8_t>(b, field(4) + 40), 1) << "observed";
  EXPECT_EQ(at<float>(b, field(5) + 8), 0.0625F) << "right eye, yaw";
  const std::size_t weights = field(6) + at<std::uint32_t>(b, field(6));
  EXPECT_EQ(at<std::uint32_t>(b, weights), 3U);
  EXPECT_EQ(at<float>(b, weights + 4), 0.5F);
  EXPECT_EQ(at<float>(b, weights + 8), 0.25F);
  const std::size_t observed = field(7) + at<std::uint32_t>(b, field(7));
  EXPECT_EQ(at<std::uint8_t>(b, observed + 4 + 2), 0);
}

}  // namespace
}  // namespace volto::protocol
