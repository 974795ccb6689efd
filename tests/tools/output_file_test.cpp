#include "tools/cli/output_file.h"

#include <fstream>
#include <sstream>
#include <string>

#include <gtest/gtest.h>

#include "tests/support/test_data.h"
#include "tools/cli/exit_status.h"

namespace volto::cli {
namespace {

std::string contents(const std::filesystem::path& path) {
  std::ifstream file(path);
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

std::size_t filesIn(const std::filesystem::path& folder) {
  return static_cast<std::size_t>(
      std::distance(std::filesystem::directory_iterator(folder), std::filesystem::directory_iterator()));
}

TEST(OutputFile, AppearsOnlyWhenCommitted) {
  test::TemporaryDir folder;
  {
    OutputFile file(folder / "w.csv");
    file.write("half");
    EXPECT_FALSE(std::filesystem::exists(folder / "w.csv"));
    file.write(" and half");
    file.commit();
  }
  EXPECT_EQ(contents(folder / "w.csv"), "half and half");
  EXPECT_EQ(filesIn(folder.path()), 1U);
}

TEST(OutputFile, AbandonedOneLeavesTheOldFileAndNothingElse) {
  test::TemporaryDir folder;
  std::ofstream(folder / "w.csv") << "old";
  {
    OutputFile file(folder / "w.csv");
    file.write("new");
  }
  EXPECT_EQ(contents(folder / "w.csv"), "old");
  EXPECT_EQ(filesIn(folder.path()), 1U);
}

TEST(OutputFile, AMissingFolderIsToldBeforeAnythingIsDone) {
  test::TemporaryDir folder;
  try {
    OutputFile file(folder / "none/w.csv");
    FAIL() << "was opened";
  } catch (const CommandError& error) {
    EXPECT_EQ(error.status(), kFailed);
    EXPECT_NE(std::string(error.what()).find("there is no folder"), std::string::npos) << error.what();
  }
}

TEST(OutputFile, AFullDiskIsAnErrorAndNotAShortFile) {
  OutputFile file("/dev/full");
  EXPECT_THROW(
      {
        file.write(std::string(1 << 20, 'x'));
        file.commit();
      },
      CommandError);
}

TEST(OutputFile, ADeviceIsWrittenToAndNeverReplaced) {
  {
    OutputFile file("/dev/null");
    file.write("away");
    file.commit();
  }
  EXPECT_TRUE(std::filesystem::is_character_file("/dev/null"));
  EXPECT_THROW(requireReplaceable("/dev/null"), CommandError);
}

}  // namespace
}  // namespace volto::cli
