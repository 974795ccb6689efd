// What every verb has in common: help, version, wrong usage.
#include <gtest/gtest.h>

#include "tests/end_to_end/world.h"

namespace volto::test {
namespace {

class CommandLine : public World {};

TEST_F(CommandLine, HelpNamesEveryVerbAndEachVerbHasAPageOfItsOwn) {
  const Finished help = volto({"help"});
  EXPECT_EQ(help.status, 0);
  EXPECT_EQ(help.err, "");
  for (const std::string verb : {"rig", "replay", "record", "bake", "track", "inspect"}) {
    EXPECT_NE(help.out.find("\n  " + verb + " "), std::string::npos) << verb;
    const Finished page = volto({"help", verb});
    EXPECT_EQ(page.status, 0);
    EXPECT_NE(page.out.find("volto " + verb), std::string::npos) << page.out;
    EXPECT_NE(page.out.find("Options"), std::string::npos) << page.out;
    EXPECT_EQ(volto({verb, "--help"}).out, page.out);
  }
  EXPECT_EQ(volto({"--help"}).out, help.out);
}

TEST_F(CommandLine, VersionIsOneLine) {
  const Finished version = volto({"--version"});
  EXPECT_EQ(version.status, 0);
  EXPECT_EQ(version.out.rfind("volto ", 0), 0U);
  EXPECT_EQ(std::count(version.out.begin(), version.out.end(), '\n'), 1);
}

TEST_F(CommandLine, AMistypedVerbIsToldWhatWasMeant) {
  const Finished run = volto({"rpelay", "x"});
  EXPECT_EQ(run.status, 2);
  EXPECT_EQ(run.err, "volto: there is no verb 'rpelay'; did you mean replay?\n");
  EXPECT_EQ(volto({}).status, 2);
  EXPECT_EQ(volto({"help", "nonsense"}).status, 2);
}

TEST_F(CommandLine, AMistypedOptionIsToldWhatWasMeant) {
  expectRefused(volto({"track", performance(), "-o", output("w.csv"), "--smothing", "2"}), 2, "track",
                "did you mean --smoothing?");
  expectRefused(volto({"rig", "a.obj", "-o", output("c.rig"), "--subdivid", "2"}), 2, "rig", "did you mean --subdivide?");
  for (const char* wrong : {"seven", "7", "-1", "auto:0", "auto:x"})
    expectRefused(volto({"rig", headMesh(), "--points", headPoints(), "-o", output("c.rig"), std::string("--subdivide=") + wrong}), 2,
                  "rig", "--subdivide");
}

TEST_F(CommandLine, MissingAndImpossibleArgumentsAreWrongUsage) {
  expectRefused(volto({"track", performance()}), 2, "track", "--output");
  expectRefused(volto({"rig"}), 2, "rig", "required");
  expectRefused(volto({"bake", performance(), "--rig", rig()}), 2, "bake", "say what to make");
  expectRefused(volto({"bake", performance(), "--rig", rig(), "--csv", output("w.csv"), "--every", "0"}), 2, "bake",
                "--every");
  expectRefused(volto({"bake", performance(), "--rig", rig(), "--png", output("p"), "--view", "above"}), 2, "bake",
                "--view");
  expectRefused(volto({"replay", performance(), "--rig", rig(), "--speed", "fast"}), 2, "replay", "--speed fast");
  expectRefused(volto({"replay", performance(), "--rig", rig(), "--speed", "-1"}), 2, "replay", "--speed");
  expectRefused(volto({"replay", performance(), "--rig", rig(), "--publish", "nonsense"}), 2, "replay", "nonsense");
  expectRefused(volto({"track", performance(), "-o", output("w.csv"), "--smoothing", "nan"}), 2, "track",
                "--smoothing");
  expectRefused(volto({"record", "nonsense", "-o", output("t.take")}), 2, "record", "nonsense");
}

TEST_F(CommandLine, AnInputIsNeverOverwrittenByTheOutput) {
  const std::string input = performance();
  const std::string before = readFile(input);
  expectRefused(volto({"track", input, "-o", input}), 2, "track", "is the input itself");
  EXPECT_EQ(readFile(input), before);
}

TEST_F(CommandLine, AnOutputThatCannotBeWrittenIsAFailure) {
  expectRefused(volto({"track", performance(), "-o", path("none/w.csv")}), 1, "track", "there is no folder");
  expectRefused(volto({"rig", headMesh(), "--points", headPoints(), "-o", path("none/c.rig")}), 1, "rig",
                "there is no folder");
  expectRefused(volto({"track", performance(), "-o", "/dev/full"}), 1, "track", "/dev/full");
}

}  // namespace
}  // namespace volto::test
