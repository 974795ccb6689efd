// A folder with what most end-to-end tests need: a character, a performance, a place for results.
#pragma once

#include <algorithm>
#include <filesystem>
#include <string>

#include <gtest/gtest.h>

#include "tests/end_to_end/process.h"
#include "tests/tools/synthetic_performance.h"

namespace volto::test {

class World : public testing::Test {
 protected:
  // Made once for all tests from the shipped head, by `volto rig` (ctest fixture character).
  std::string rig() const { return VOLTO_TEST_RIG; }
  // The shipped head and its points.
  std::string headMesh() const { return (sourceDir() / "rig/assets/volto_head.obj").string(); }
  std::string headPoints() const { return (sourceDir() / "rig/assets/volto_head.points.json").string(); }

  // A file in this test's own folder.
  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  std::string write(const std::string& name, const std::string& bytes) const {
    writeFile(folder_ / name, bytes);
    return path(name);
  }
  // OpenFace CSV of `frames` frames at 60 a second.
  std::string performance(std::size_t frames = 60) const {
    return write("performance.csv", openFaceCsv(syntheticPerformance({.frames = frames})));
  }
  // A folder that bad input must leave empty.
  std::string output(const std::string& name) const {
    std::filesystem::create_directory(folder_ / "output");
    return (folder_ / "output" / name).string();
  }
  bool nothingWritten() const {
    return !std::filesystem::exists(folder_ / "output") || std::filesystem::is_empty(folder_ / "output");
  }
  std::string endpoint(const std::string& name = "stream") const { return "ipc://" + path(name); }

  // Refused with one line that begins with the program and the verb and holds `said`, and without a trace on the disk.
  void expectRefused(const Finished& run, int status, const std::string& verb, const std::string& said) const {
    EXPECT_EQ(run.status, status) << run.err;
    EXPECT_EQ(run.err.rfind("volto " + verb + ": ", 0), 0U) << run.err;
    EXPECT_EQ(std::count(run.err.begin(), run.err.end(), '\n'), 1) << run.err;
    EXPECT_NE(run.err.find(said), std::string::npos) << run.err;
    EXPECT_EQ(run.out, "");
    EXPECT_TRUE(nothingWritten());
  }

  TemporaryDir folder_;
};

}  // namespace volto::test
