// A real kernel: QEMU boots one with its camera test driver, and Volto is tried on it. One boot; what happened is read
// from its files.
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/end_to_end/process.h"
#include "tests/support/test_data.h"

namespace volto::test {
namespace {

using nlohmann::json;

TEST(Guest, VoltoStreamsFromARealDriverAndSurvivesADisconnect) {
  const TemporaryDir out;
  std::vector<std::string> command{(sourceDir() / "tests/guest/run").string(), voltoProgram(), VOLTO_V4L2_ANSWERS,
                                   out.path().string()};
  // The whole chain too, where there are models.
  const auto data = dataDir();
  const TemporaryDir made;
  if (data) {
    const std::string head = (sourceDir() / "rig/assets/volto_head").string(), rig = (made / "head.rig").string();
    ASSERT_EQ(volto({"rig", head + ".obj", "--points", head + ".points.json", "-o", rig}).status, 0);
    command.insert(command.end(), {rig, (*data / "models").string()});
  }
  Process guest(command);
  const Finished finished = guest.wait(std::chrono::seconds(290));
  if (finished.status == 77) GTEST_SKIP() << finished.out;
  ASSERT_EQ(finished.status, 0) << finished.out << finished.err;

  // What the fake camera was made after is still what the kernel does.
  EXPECT_EQ(readFile(out / "answers.txt"), readFile(sourceDir() / "tests/capture/fake/kernel_answers.txt"));

  const json cameras = json::parse(readFile(out / "cameras.json"))["cameras"];
  ASSERT_EQ(cameras.size(), 1U);
  EXPECT_EQ(cameras[0]["path"], "/dev/video0");
  EXPECT_EQ(cameras[0]["driver"], "vivid");
  EXPECT_EQ(cameras[0]["problem"], "");

  EXPECT_EQ(readFile(out / "try.status"), "0\n") << readFile(out / "try.err");
  const json trial = json::parse(readFile(out / "try.json"));
  std::cout << "in the guest: " << trial["counters"].dump() << " " << trial["states"].dump() << "\n";
  EXPECT_EQ(trial["width"], 320);
  EXPECT_GE(trial["counters"]["captured"], 20) << trial.dump(2);
  EXPECT_EQ(trial["counters"]["corrupt"], 0);
  EXPECT_EQ(trial["counters"]["losses"], 1);
  EXPECT_EQ(trial["counters"]["reconnects"], 1);
  // In a simulated machine of unknown speed other states may lie between (a stall, say); these come in this order.
  std::string story;
  for (const json& state : trial["states"]) story += state["state"].get<std::string>() + "; ";
  EXPECT_TRUE(story.starts_with("streaming; ")) << story;
  EXPECT_NE(story.find("no signal; "), std::string::npos) << story;
  EXPECT_TRUE(story.ends_with("streaming; ")) << story;

  if (!data) return;
  const std::string figures = readFile(out / "run.out");
  std::cout << figures;
  EXPECT_EQ(readFile(out / "run.status"), "0\n") << readFile(out / "run.err");
  EXPECT_NE(figures.find(" 0 with a face"), std::string::npos) << figures;
  EXPECT_EQ(figures.find("\n0 frames"), std::string::npos) << figures << readFile(out / "run.err");
}

}  // namespace
}  // namespace volto::test
