// volto run as a program: videos, cameras and models that are good, bad and missing.
#include <csignal>
#include <filesystem>
#include <random>
#include <thread>

#include <gtest/gtest.h>

#include "protocol/take_reader.h"
#include "tests/end_to_end/world.h"

namespace volto::test {
namespace {

class Run : public World {
 protected:
  // A folder of pictures, each a PPM file.
  template <typename Pixel>
  std::string pictures(const std::string& name, int width, int height, int count, Pixel pixel) const {
    std::filesystem::create_directory(folder_ / name);
    for (int i = 0; i < count; ++i) {
      std::string bytes = "P6\n" + std::to_string(width) + " " + std::to_string(height) + "\n255\n";
      for (int j = 0; j < 3 * width * height; ++j) bytes += static_cast<char>(pixel());
      char file[32];
      std::snprintf(file, sizeof file, "/%03d.ppm", i);
      write(name + file, bytes);
    }
    return path(name);
  }
  Finished run(const std::string& source, const std::filesystem::path& models,
               std::vector<std::string> more = {}) const {
    std::vector<std::string> all{"run",           source,      "--rig",         rig(),       "--models",
                                 models.string(), "--publish", endpoint("run"), "--threads", "1"};
    all.insert(all.end(), more.begin(), more.end());
    return volto(all);
  }
};

constexpr const char* kClip = "video/head-pose-face-detection-male.gif";

// Names what is wrong in one line, with its exit status, before anything is sent.
TEST_F(Run, WhatCannotBeASourceIsRefused) {
  const std::string models = path("models");
  std::filesystem::create_directory(models);
  const auto refused = [&](const std::string& source, int status, const std::string& said) {
    expectRefused(run(source, models), status, "run", said);
  };
  refused("udp://127.0.0.1:99999", 2, "99999");
  refused("http://example.com/x.mp4", 2, "no source");
  refused(path("none.mp4"), 78, "model");  // without models nothing can be seen: that is said first
  expectRefused(volto({"run", "udp://127.0.0.1:11999", "--rig", path("none.rig")}), 66, "run", "none.rig");
  expectRefused(volto({"run", "udp://127.0.0.1:11999", "--rig", rig(), "--smoothing", "nan"}), 2, "run", "smoothing");
}

TEST_F(Run, AVideoThatIsNoneIsRefused) {
  VOLTO_REQUIRE_DATA(data);
  const std::filesystem::path models = data / "models";
  expectRefused(run(path("none.mp4"), models), 66, "run", "none.mp4");
  expectRefused(run(write("text.mp4", "hello\n"), models), 65, "run", "is no video");
  expectRefused(run(write("empty.mp4", ""), models), 65, "run", "is no video");
  // A header, a second of nothing: sound without pictures.
  const std::string wave =
      std::string("RIFF$>\0\0WAVEfmt \x10\0\0\0\1\0\1\0@\x1f\0\0\x80>\0\0\2\0\x10\0data\0>\0\0", 44) +
      std::string(15872, '\0');
  expectRefused(run(write("sound.wav", wave), models), 65, "run", "holds no video stream");
  const std::string clip = readFile(data / "video/talking_512x512_25fps.mp4");
  expectRefused(run(write("cut.mp4", clip.substr(0, clip.size() / 2)), models), 65, "run", "cut.mp4");
}

TEST_F(Run, BlackAndNoisyPicturesOfAnySizeShowNobodyAndAreNoError) {
  VOLTO_REQUIRE_DATA(data);
  std::mt19937 random(1);
  const std::string sizes = pictures("sizes", 320, 240, 3, [] { return 0; });
  for (int i = 3; i < 6; ++i)
    std::filesystem::copy(
        pictures("small" + std::to_string(i), 64, 200, 1, [&] { return static_cast<int>(random() % 256); }) +
            "/000.ppm",
        sizes + "/00" + std::to_string(i) + ".ppm");
  const Finished done = run(sizes, data / "models");
  EXPECT_EQ(done.status, 0) << done.err;
  EXPECT_NE(done.out.find("6 frames"), std::string::npos) << done.out;
  EXPECT_NE(done.out.find(" 0 with a face"), std::string::npos) << done.out;
  EXPECT_NE(done.err.find("no face in any of the pictures"), std::string::npos) << done.err;
}

TEST_F(Run, AWindowWithoutADisplayIsRefused) {
  VOLTO_REQUIRE_DATA(data);
  Process process({"/usr/bin/env", "-u", "DISPLAY", voltoProgram(), "run", (data / kClip).string(), "--rig", rig(),
                   "--models", (data / "models").string(), "--publish", endpoint("window"), "--window"});
  expectRefused(process.wait(), 69, "run", "$DISPLAY is not set");
}

TEST_F(Run, AClipIsTrackedRecordedAndDrawn) {
  VOLTO_REQUIRE_DATA(data);
  const Finished done = run((data / kClip).string(), data / "models",
                            {"--record", path("a.take"), "--sheet", path("sheet.png"), "--preview", path("preview.png"),
                             "--profile", path("actor.json"), "--stats"});
  EXPECT_EQ(done.status, 0) << done.err;
  EXPECT_NE(done.out.find("62 with a face; 0 dropped"), std::string::npos) << done.out;
  for (const char* picture : {"sheet.png", "preview.png"})
    EXPECT_EQ(readFile(path(picture)).substr(0, 8), "\x89PNG\r\n\x1a\n") << picture;
  EXPECT_NE(readFile(path("actor.json")).find("volto_profile"), std::string::npos);
  EXPECT_EQ(protocol::summarizeTake(path("a.take")).streams.begin()->second.messages, 62U);
  // The same video gives the same numbers; a take that is there is not replaced unasked.
  EXPECT_EQ(run((data / kClip).string(), data / "models", {"--record", path("a.take")}).status, 1);
  EXPECT_EQ(run((data / kClip).string(), data / "models", {"--record", path("b.take")}).status, 0);
  EXPECT_EQ(readFile(path("a.take")).size(), readFile(path("b.take")).size());
  protocol::TakeReader first(path("a.take")), second(path("b.take"));
  protocol::LandmarkMessage a, b;
  while (first.next(a)) {
    ASSERT_TRUE(second.next(b));
    EXPECT_EQ(a.frame.t_capture_ns, b.frame.t_capture_ns);
    EXPECT_EQ(a.frame.points_px, b.frame.points_px);
  }
}

TEST_F(Run, ModelsThatAreMissingCutWrongOrNoneAreTold) {
  VOLTO_REQUIRE_DATA(data);
  const std::string yunet = readFile(data / "models/yunet_n_320_320.onnx"),
                    pfld = readFile(data / "models/pfld_68.onnx");
  const auto refused = [&](const char* name, const std::string& faces, const std::string& points, int status,
                           const std::string& said, const std::vector<std::string>& more = {}) {
    const std::filesystem::path models = folder_ / name;
    std::filesystem::create_directory(models);
    if (!faces.empty()) writeFile(models / "yunet_n_320_320.onnx", faces);
    if (!points.empty()) writeFile(models / "pfld_68.onnx", points);
    expectRefused(run((data / kClip).string(), models, more), status, "run", said);
  };
  const std::vector<std::string> any{"--allow-unlisted-model"};
  expectRefused(run((data / kClip).string(), path("nowhere")), 78, "run", "nowhere");
  refused("missing", yunet, "", 78, "pfld_68.onnx is in none of");
  refused("cut", yunet, pfld.substr(0, pfld.size() / 2), 65, "SHA-256");
  refused("changed", yunet, pfld + "x", 65, "--allow-unlisted-model");
  refused("text", yunet, "hello\n", 65, "cannot read it as ONNX", any);
  refused("cut_allowed", yunet, pfld.substr(0, pfld.size() / 2), 65, "pfld_68.onnx", any);
  refused("other_shape", yunet, yunet, 65, "pfld_68.onnx", any);
  refused("swapped", pfld, pfld, 65, "yunet_n_320_320.onnx", any);
}

TEST_F(Run, SigtermEndsALoopCleanly) {
  VOLTO_REQUIRE_DATA(data);
  Process process({voltoProgram(), "run", (data / kClip).string(), "--rig", rig(), "--models",
                   (data / "models").string(), "--publish", endpoint("loop"), "--loop", "--realtime", "--preview",
                   path("p.png")});
  for (int i = 0; i < 300 && !std::filesystem::exists(path("p.png")); ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  process.signal(SIGTERM);
  const Finished done = process.wait();
  EXPECT_EQ(done.status, 0) << done.err;
  EXPECT_NE(done.out.find("with a face"), std::string::npos) << done.out;
}

#ifdef VOLTO_FAKE_PRELOAD
// The fake camera under the real program: bars, so nobody is seen; unplugged and plugged in again under another number.
TEST_F(Run, ACameraThatComesAndGoesIsFollowed) {
  VOLTO_REQUIRE_DATA(data);
  std::filesystem::create_directory(folder_ / "root");
  const auto camera = [&](const std::string& script, const std::string& seconds) {
    Process process({"/usr/bin/env", "VOLTO_FAKE_CAMERA=" + script, "VOLTO_FAKE_ROOT=" + path("root"),
                     std::string("LD_PRELOAD=") + VOLTO_FAKE_PRELOAD, voltoProgram(), "run", "camera:/dev/video0",
                     "--rig", rig(), "--models", (data / "models").string(), "--publish", endpoint("camera"),
                     "--seconds", seconds});
    return process.wait();
  };
  const Finished done =
      camera("camera \"Desk\" as video0 by-id usb-Desk-video-index0; at 0.7s unplug; at 1s replug as video2", "2.5");
  EXPECT_EQ(done.status, 0) << done.err;
  EXPECT_NE(done.err.find("is gone"), std::string::npos) << done.err;
  EXPECT_EQ(done.out.find("0 frames"), std::string::npos) << done.out;
  EXPECT_EQ(camera("camera X as none", "1").status, 69);
  const Finished denied = camera("camera X as video0; open EACCES", "1"),
                 busy = camera("camera X as video0; busy", "1");
  EXPECT_EQ(denied.status, 69);
  EXPECT_NE(denied.err.find("permission denied"), std::string::npos) << denied.err;
  EXPECT_EQ(busy.status, 69);
  EXPECT_NE(busy.err.find("in use"), std::string::npos) << busy.err;
}
#endif

}  // namespace
}  // namespace volto::test
