// The fake camera under whole programs: Volto's own, and those that other people wrote to find drivers' faults.
#include <algorithm>
#include <cstdlib>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/end_to_end/process.h"
#include "tests/support/test_data.h"

namespace volto::test {
namespace {

using nlohmann::json;

// Runs a program that sees the cameras of the script.
Finished withCameras(const std::string& script, std::vector<std::string> command) {
  const TemporaryDir root;
  std::vector<std::string> all{"/usr/bin/env", "VOLTO_FAKE_CAMERA=" + script, "VOLTO_FAKE_ROOT=" + root.path().string(),
                               std::string("LD_PRELOAD=") + VOLTO_FAKE_PRELOAD};
  all.insert(all.end(), command.begin(), command.end());
  Process process(all);
  return process.wait(std::chrono::seconds(100));
}

bool installed(const std::string& program) {
  return std::system(("command -v " + program + " >/dev/null 2>&1").c_str()) == 0;
}

#define REQUIRE_PROGRAM(name) \
  if (!installed(name)) GTEST_SKIP() << "SKIPPED: no " name " on this machine"

const char* const kCamera = "camera \"Fake Camera\" as video0 metadata by-id usb-Fake_0001-video-index0";

// "at_s" of the n-th change of state.
double changeAt(const json& trial, std::size_t n, const std::string& state) {
  EXPECT_GT(trial["states"].size(), n) << trial["states"].dump();
  if (trial["states"].size() <= n) return -1;
  EXPECT_EQ(trial["states"][n]["state"], state) << trial["states"].dump();
  return trial["states"][n]["at_s"];
}

TEST(CamerasVerb, ListsWhatTheCameraOffers) {
  const Finished listed = withCameras(kCamera, {voltoProgram(), "cameras", "--json"});
  ASSERT_EQ(listed.status, 0) << listed.err;
  const json cameras = json::parse(listed.out)["cameras"];
  ASSERT_EQ(cameras.size(), 1U) << "the metadata node is none";
  EXPECT_EQ(cameras[0]["path"], "/dev/video0");
  EXPECT_EQ(cameras[0]["name"], "Fake Camera");
  EXPECT_EQ(cameras[0]["by_id"], "usb-Fake_0001-video-index0");
  EXPECT_EQ(cameras[0]["formats"][0]["format"], "YUYV");
  EXPECT_EQ(cameras[0]["formats"][0]["sizes"][0]["fps"][0], 10.0);
  const std::string words = withCameras(kCamera, {voltoProgram(), "cameras"}).out;
  EXPECT_NE(words.find("camera:usb-Fake_0001-video-index0"), std::string::npos) << words;
  EXPECT_NE(words.find("--control power_line_frequency=1"), std::string::npos) << words;
}

TEST(CamerasVerb, TakesPicturesInRealTime) {
  const Finished tried = withCameras(
      kCamera, {voltoProgram(), "cameras", "camera:/dev/v4l/by-id/usb-Fake_0001-video-index0", "--try", "2", "--json"});
  ASSERT_EQ(tried.status, 0) << tried.err;
  const json trial = json::parse(tried.out);
  EXPECT_EQ(trial["fps_agreed"], 30.0);
  EXPECT_GE(trial["counters"]["captured"], 30);
  EXPECT_EQ(trial["counters"]["bad_timestamps"], 0);
  EXPECT_EQ(trial["counters"]["losses"], 0);
}

TEST(CamerasVerb, GoesOnUnderAnotherNumberAfterBeingPluggedInAgain) {
  const Finished tried = withCameras(std::string(kCamera) + ";at 1s unplug;at 2.5s replug as video4",
                                     {voltoProgram(), "cameras", "--try", "4.5", "--json"});
  ASSERT_EQ(tried.status, 0) << tried.err;
  const json trial = json::parse(tried.out);
  changeAt(trial, 0, "streaming");
  // The figures are those of trouble_test in virtual time; here a busy machine gets a quarter of a second more.
  EXPECT_LE(changeAt(trial, 1, "no signal"), 1.0 + 0.083 + 0.25);
  EXPECT_LE(changeAt(trial, 2, "streaming"), 2.5 + 1.0 + 0.25);
  EXPECT_EQ(trial["path"], "/dev/video4");
  EXPECT_EQ(trial["counters"]["reconnects"], 1);
}

TEST(CamerasVerb, SaysInOneLineWhyACameraCannotBeUsed) {
  const std::vector<std::pair<std::string, std::string>> kCases{
      {"camera X as none", "there is no camera"},
      {"open EACCES", "permission denied"},
      {"busy", "in use by"},
      {"formats H264 640x480@30", "H264"},
  };
  for (const auto& [script, text] : kCases) {
    const Finished tried = withCameras(script, {voltoProgram(), "cameras", "--try", "1"});
    EXPECT_EQ(tried.status, 69) << script;
    EXPECT_NE(tried.err.find(text), std::string::npos) << tried.err;
    EXPECT_EQ(std::count(tried.err.begin(), tried.err.end(), '\n'), 1) << tried.err;
  }
}

TEST(CamerasVerb, RefusesWhatMakesNoSense) {
  const std::vector<std::vector<std::string>> kCases{{"cameras", "x"},
                                                     {"cameras", "--try", "-1"},
                                                     {"cameras", "--try", "1", "--size", "640"},
                                                     {"cameras", "--try", "1", "--format", "H264"},
                                                     {"cameras", "--try", "1", "--control", "gain"},
                                                     {"cameras", "--try", "1", "--fps", "-5"}};
  for (std::vector<std::string> arguments : kCases) {
    arguments.insert(arguments.begin(), voltoProgram());
    const Finished finished = withCameras(kCamera, arguments);
    EXPECT_EQ(finished.status, 2) << finished.err;
  }
}

TEST(FakeCamera, AnswersAsTheKernelDoes) {
  const Finished answers = withCameras("camera Fake as video0 button;formats YUYV 320x180@30",
                                       {VOLTO_V4L2_ANSWERS, "/dev/video0", "--disconnect"});
  ASSERT_EQ(answers.status, 0) << answers.err;
  EXPECT_EQ(answers.out, readFile(sourceDir() / "tests/capture/fake/kernel_answers.txt"));
}

TEST(FakeCamera, PassesV4l2Compliance) {
  REQUIRE_PROGRAM("v4l2-compliance");
  const Finished finished = withCameras(kCamera, {"v4l2-compliance", "-d", "/dev/video0", "-s"});
  EXPECT_EQ(finished.status, 0) << finished.out;
  EXPECT_NE(finished.out.find("Failed: 0"), std::string::npos) << finished.out;
}

TEST(FakeCamera, StreamsToV4l2Ctl) {
  REQUIRE_PROGRAM("v4l2-ctl");
  const Finished finished =
      withCameras(kCamera, {"v4l2-ctl", "-d", "/dev/video0", "--stream-mmap", "--stream-count=30"});
  EXPECT_EQ(finished.status, 0) << finished.err;
}

TEST(FakeCamera, StreamsToFfmpeg) {
  REQUIRE_PROGRAM("ffmpeg");
  const Finished finished =
      withCameras(kCamera, {"ffmpeg", "-hide_banner", "-loglevel", "error", "-f", "v4l2", "-input_format", "mjpeg",
                            "-i", "/dev/video0", "-frames:v", "10", "-f", "null", "-"});
  EXPECT_EQ(finished.status, 0) << finished.err;
  EXPECT_EQ(finished.err, "");
}

}  // namespace
}  // namespace volto::test
