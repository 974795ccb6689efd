#include "capture/video/video_source.h"

#include <chrono>
#include <fstream>
#include <iterator>
#include <system_error>
#include <thread>

#include <gtest/gtest.h>

#include "capture/errors.h"
#include "tests/support/test_data.h"

namespace volto::capture {
namespace {

using namespace std::chrono_literals;

// A picture of one colour, as the simplest of image files.
void writePpm(const std::filesystem::path& path, int width, int height, std::uint8_t red) {
  std::ofstream file(path, std::ios::binary);
  file << "P6\n" << width << " " << height << "\n255\n";
  for (int i = 0; i < width * height; ++i) file << static_cast<char>(red) << '\0' << '\0';
}

std::string bytesOf(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

std::string errorOf(const std::filesystem::path& path) {
  try {
    openVideo(path);
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

struct Watched {
  std::vector<std::int64_t> times;
  int width = 0, height = 0;
};

Watched watch(ImageSource& source) {
  Watched out;
  Image image;
  while (source.next(image, 1s) == Next::frame) {
    EXPECT_EQ(image.capture_seq, out.times.size() + 1);
    if (!out.times.empty()) {
      EXPECT_GT(image.t_capture_ns, out.times.back());
    }
    out.times.push_back(image.t_capture_ns);
    out.width = image.width;
    out.height = image.height;
  }
  EXPECT_EQ(source.state(), SourceState::ended);
  EXPECT_EQ(source.next(image, 0s), Next::ended);
  return out;
}

class Sequence : public ::testing::Test {
 protected:
  Sequence() {
    for (int i = 0; i < 5; ++i)
      writePpm(dir / ("f00" + std::to_string(i) + ".ppm"), 32, 24, static_cast<std::uint8_t>(10 + 20 * i));
  }
  test::TemporaryDir dir;
};

// Grey, 4:2:0, as cameras and videos have it.
void writeY4m(const std::filesystem::path& path, int width, int height, int pictures) {
  std::ofstream file(path, std::ios::binary);
  file << "YUV4MPEG2 W" << width << " H" << height << " F25:1 Ip A1:1 C420jpeg\n";
  for (int i = 0; i < pictures; ++i) {
    file << "FRAME\n" << std::string(static_cast<std::size_t>(width * height), static_cast<char>(90));
    file << std::string(static_cast<std::size_t>(2 * ((width + 1) / 2) * ((height + 1) / 2)), static_cast<char>(128));
  }
}

TEST(VideoSource, APictureOfAnyWidthIsWrittenToItsLastByteAndNotBeyond) {
  test::TemporaryDir dir;
  for (const int width : {300, 302, 317, 33, 32, 20}) {
    writeY4m(dir / "v.y4m", width, 6, 2);
    const auto source = openVideo(dir / "v.y4m");
    const std::size_t bytes = static_cast<std::size_t>(width) * 6 * 3;
    constexpr std::size_t kBeyond = 64;
    Image first, image;
    image.bgr.assign(bytes + kBeyond, 0xA5);  // it keeps this memory
    ASSERT_EQ(source->next(first, 1s), Next::frame);
    ASSERT_EQ(source->next(image, 1s), Next::frame);
    ASSERT_EQ(image.bgr.size(), bytes) << width;
    for (const std::uint8_t value : image.bgr) ASSERT_NEAR(value, 90, 12) << width;
    image.bgr.resize(bytes);
    const std::uint8_t* const end = image.bgr.data() + bytes;
    ASSERT_GE(image.bgr.capacity(), bytes + kBeyond);
    for (std::size_t i = 0; i < kBeyond; ++i) ASSERT_EQ(end[i], 0xA5) << width << " wide, byte " << i << " after it";
  }
}

TEST_F(Sequence, APatternGivesItsPicturesAtTheRateThatWasSaid) {
  const auto source = openVideo(dir / "f%03d.ppm", {.sequence_rate_hz = 10});
  const Watched seen = watch(*source);
  ASSERT_EQ(seen.times.size(), 5U);
  EXPECT_EQ(seen.times[4], 400'000'000);
  EXPECT_EQ(seen.width, 32);
  EXPECT_EQ(seen.height, 24);
}

TEST_F(Sequence, AFolderIsASequenceInTheOrderOfNames) {
  const auto source = openVideo(dir.path());
  Image image;
  for (int i = 0; i < 5; ++i) {
    ASSERT_EQ(source->next(image, 1s), Next::frame);
    EXPECT_NEAR(image.bgr[2], 10 + 20 * i, 2) << "red";
    EXPECT_NEAR(image.bgr[0], 0, 2) << "blue";
  }
  EXPECT_EQ(source->next(image, 1s), Next::ended);
}

TEST_F(Sequence, InRealTimePicturesComeWhenTheyAreDue) {
  const auto source = openVideo(dir / "f%03d.ppm", {.realtime = true, .sequence_rate_hz = 20});
  const auto start = std::chrono::steady_clock::now();
  EXPECT_EQ(watch(*source).times.size() + source->counters().dropped, 5U);
  EXPECT_GT(std::chrono::steady_clock::now() - start, 195ms);
}

TEST_F(Sequence, InRealTimeALateCallerGetsTheNewestAndTheOthersAreCounted) {
  const auto source = openVideo(dir / "f%03d.ppm", {.realtime = true, .sequence_rate_hz = 50});
  Image image;
  ASSERT_EQ(source->next(image, 1s), Next::frame);
  const auto until = std::chrono::steady_clock::now() + 200ms;
  while (std::chrono::steady_clock::now() < until) {
  }
  ASSERT_EQ(source->next(image, 1s), Next::frame);
  EXPECT_EQ(image.capture_seq, 5U);
  EXPECT_EQ(source->counters().dropped, 3U);
}

TEST_F(Sequence, InRealTimeWithPatienceALateCallerMissesNothing) {
  const auto source = openVideo(dir / "f%03d.ppm", {.realtime = true, .patience = 60s, .sequence_rate_hz = 50});
  Image image;
  ASSERT_EQ(source->next(image, 1s), Next::frame);
  std::this_thread::sleep_for(100ms);
  for (std::uint64_t seq = 2; seq <= 5; ++seq) {
    ASSERT_EQ(source->next(image, 1s), Next::frame);
    EXPECT_EQ(image.capture_seq, seq);
  }
  EXPECT_EQ(source->counters().dropped, 0U);
}

TEST_F(Sequence, ATimeoutIsKept) {
  const auto source = openVideo(dir / "f%03d.ppm", {.realtime = true, .sequence_rate_hz = 1});
  Image image;
  ASSERT_EQ(source->next(image, 1s), Next::frame);
  EXPECT_EQ(source->next(image, 20ms), Next::nothing);
}

TEST_F(Sequence, ALoopGoesOnWithRisingTimes) {
  const auto source = openVideo(dir / "f%03d.ppm", {.loop = true, .sequence_rate_hz = 10});
  Image image;
  std::int64_t last = -1;
  for (int i = 0; i < 12; ++i) {
    ASSERT_EQ(source->next(image, 1s), Next::frame) << i;
    EXPECT_GT(image.t_capture_ns, last);
    last = image.t_capture_ns;
  }
}

TEST_F(Sequence, PicturesMayChangeTheirSize) {
  writePpm(dir / "f003.ppm", 48, 20, 200);
  const auto source = openVideo(dir / "f%03d.ppm");
  Image image;
  std::vector<int> widths;
  while (source->next(image, 1s) == Next::frame) {
    EXPECT_EQ(image.bgr.size(), static_cast<std::size_t>(3 * image.width * image.height));
    widths.push_back(image.width);
  }
  EXPECT_EQ(widths, (std::vector<int>{32, 32, 32, 48, 32}));
}

TEST(Video, WhatIsNoneIsToldInOneLineWithWhatToDo) {
  test::TemporaryDir dir;
  std::ofstream(dir / "text.mp4") << "this is no video, it only looks like one by its name\n";
  std::ofstream(dir / "empty.mp4").flush();
  std::filesystem::create_directory(dir / "folder");
  for (const char* name : {"text.mp4", "empty.mp4", "folder"}) {
    const std::string error = errorOf(dir / name);
    EXPECT_TRUE(error.starts_with((dir / name).string())) << error;
    EXPECT_NE(error.find("; "), std::string::npos) << error;
    EXPECT_EQ(error.find('\n'), std::string::npos) << error;
  }
  EXPECT_THROW(openVideo(dir / "nowhere.mp4"), std::system_error);
}

TEST(Video, APlaylistCannotReachOtherProtocols) {
  test::TemporaryDir dir;
  std::ofstream(dir / "list.m3u8") << "#EXTM3U\n#EXT-X-TARGETDURATION:4\n#EXTINF:4,\nhttp://127.0.0.1:9/x.ts\n";
  EXPECT_NE(errorOf(dir / "list.m3u8").find("list.m3u8: is a list of other files (hls)"), std::string::npos);
  // By its contents, not by its name.
  std::ofstream(dir / "list.mp4") << "ffconcat version 1.0\nfile 'other.mp4'\n";
  EXPECT_NE(errorOf(dir / "list.mp4").find("list.mp4: is a list of other files (concat)"), std::string::npos);
}

TEST(Video, TheTalkingClipHas200PicturesAt25ASecond) {
  VOLTO_REQUIRE_DATA(data);
  const auto source = openVideo(data / "video/talking_512x512_25fps.mp4");
  EXPECT_EQ(source->info().rate_hz, 25);
  const Watched seen = watch(*source);
  ASSERT_EQ(seen.times.size(), 200U);
  EXPECT_EQ(seen.times.back(), 199 * 40'000'000LL);
  EXPECT_EQ(seen.width, 512);
  EXPECT_TRUE(source->notice().empty()) << source->notice();
}

TEST(Video, AnAnimatedGifHasItsOwnTimes) {
  VOLTO_REQUIRE_DATA(data);
  const Watched seen = watch(*openVideo(data / "video/head-pose-face-detection-male.gif"));
  EXPECT_EQ(seen.width, 480);
  EXPECT_GT(seen.times.size(), 50U);
  EXPECT_NEAR(static_cast<double>(seen.times.back()) * 1e-9, static_cast<double>(seen.times.size() - 1) / 12, 0.3);
}

TEST(Video, AClipThatIsCutEndsEarlyAndSaysSo) {
  VOLTO_REQUIRE_DATA(data);
  test::TemporaryDir dir;
  const std::string whole = bytesOf(data / "video/head-pose-face-detection-male.gif");
  std::ofstream(dir / "cut.gif", std::ios::binary) << whole.substr(0, whole.size() / 2);
  const auto gif = openVideo(dir / "cut.gif");
  const std::size_t pictures = watch(*gif).times.size();
  EXPECT_GT(pictures, 10U);
  EXPECT_LT(pictures, 50U);

  const std::string clip = bytesOf(data / "video/talking_512x512_25fps.mp4");
  std::ofstream(dir / "cut.mp4", std::ios::binary) << clip.substr(0, clip.size() * 2 / 3);
  try {
    const auto source = openVideo(dir / "cut.mp4");
    EXPECT_LT(watch(*source).times.size(), 200U);
    EXPECT_NE(source->notice().find("cut off"), std::string::npos) << source->notice();
  } catch (const InputError& error) {  // its index was at the end
    EXPECT_NE(std::string(error.what()).find("cut.mp4"), std::string::npos);
  }
}

}  // namespace
}  // namespace volto::capture
