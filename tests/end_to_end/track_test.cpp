// volto track: landmarks to weights.
#include <cmath>
#include <cstdlib>
#include <map>
#include <sstream>
#include <thread>

#include <gtest/gtest.h>

#include "frames/arkit_blendshapes.h"
#include "protocol/take_writer.h"
#include "tests/end_to_end/world.h"

namespace volto::test {
namespace {

// Columns by name.
using Table = std::map<std::string, std::vector<std::string>>;

Table table(const std::string& csv) {
  Table result;
  std::istringstream stream(csv);
  std::vector<std::string> header;
  for (std::string line; std::getline(stream, line);) {
    std::istringstream row(line + ",");  // getline forgets an empty last cell
    std::vector<std::string> cells;
    for (std::string cell; std::getline(row, cell, ',');) cells.push_back(cell);
    if (header.empty()) {
      header = cells;
    } else {
      for (std::size_t i = 0; i < header.size(); ++i) result[header[i]].push_back(i < cells.size() ? cells[i] : "?");
    }
  }
  return result;
}

class Track : public World {};

TEST_F(Track, WritesTheHeaderThatOthersRelyOnAndARowPerRow) {
  const std::string out = output("w.csv");
  const Finished run = volto({"track", performance(40), "-o", out, "--mask", output("m.csv")});
  ASSERT_EQ(run.status, 0) << run.err;
  EXPECT_EQ(run.out + run.err, "");  // quiet
  const std::string csv = readFile(out);
  std::string header = "timestamp";
  for (const std::string_view name : kArkitBlendshapeNames) (header += ",") += name;
  EXPECT_EQ(csv.substr(0, csv.find('\n')), header + ",headYaw,headPitch,headRoll");
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 41);
  const Table weights = table(csv);
  EXPECT_EQ(weights.at("timestamp")[3], "0.0500");
  for (const auto& [name, column] : weights) {
    for (const std::string& cell : column) {
      if (!cell.empty()) {
        EXPECT_TRUE(std::isfinite(std::strtod(cell.c_str(), nullptr))) << name;
      }
    }
  }
  EXPECT_EQ(weights.at("tongueOut")[20], "");  // 68 points show no tongue: unknown, not zero
  const std::string mask = readFile(output("m.csv"));
  EXPECT_EQ(std::count(mask.begin(), mask.end(), '\n'), 41);
  EXPECT_EQ(mask.rfind("timestamp,2.1_x,2.1_y,2.1_z,", 0), 0U);
}

TEST_F(Track, HeadAnglesAreInDegreesAndTurnAsTheHeadDid) {
  ASSERT_EQ(volto({"track", performance(240), "-o", output("w.csv"), "--2d"}).status, 0);
  const Table weights = table(readFile(output("w.csv")));
  double low = 0, high = 0;
  for (const std::string& cell : weights.at("headYaw")) {
    low = std::min(low, std::strtod(cell.c_str(), nullptr));
    high = std::max(high, std::strtod(cell.c_str(), nullptr));
  }
  const double true_range = 2 * 0.15 * 180 / 3.14159265;  // 17 degrees
  EXPECT_NEAR(high - low, true_range, 3.0);
}

TEST_F(Track, TakesCsvFromAPipeAndGivesCsvToOne) {
  const std::string input = performance();
  ASSERT_EQ(volto({"track", input, "-o", output("w.csv")}).status, 0);
  const Finished piped = volto({"track", "-", "-o", "-"}, readFile(input));
  EXPECT_EQ(piped.status, 0) << piped.err;
  EXPECT_EQ(piped.out, readFile(output("w.csv")));
}

TEST_F(Track, SameInputGivesTheSameBytes) {
  const std::string input = performance();
  for (const std::string mode : {"--2d", "--causal"}) {
    ASSERT_EQ(volto({"track", input, "-o", output("a.csv"), mode}).status, 0);
    ASSERT_EQ(volto({"track", input, "-o", output("b.csv"), mode}).status, 0);
    EXPECT_EQ(readFile(output("a.csv")), readFile(output("b.csv"))) << mode;
  }
}

TEST_F(Track, LostFacesKeepTheirRows) {
  auto frames = syntheticPerformance({.frames = 120});
  for (std::size_t i = 40; i < 100; ++i) frames[i].face_present = false;
  ASSERT_EQ(volto({"track", write("lost.csv", openFaceCsv(frames)), "-o", output("w.csv")}).status, 0);
  const Table weights = table(readFile(output("w.csv")));
  ASSERT_EQ(weights.at("jawOpen").size(), 120U);
  EXPECT_NEAR(std::strtod(weights.at("jawOpen")[95].c_str(), nullptr), 0.0, 0.02);  // held, then eased to neutral
}

TEST_F(Track, LiveLinkWeightsPassThrough) {
  ASSERT_EQ(volto({"track", write("l.csv", liveLinkCsv(50)), "-o", output("w.csv")}).status, 0);
  const Table weights = table(readFile(output("w.csv")));
  EXPECT_EQ(weights.at("jawOpen")[25], "0.500000");
  EXPECT_EQ(weights.at("tongueOut")[25], "0.500000");
  EXPECT_EQ(weights.at("jawOpen").size(), 50U);
}

TEST_F(Track, ATakeIsReadWhileItIsBeingWritten) {
  const auto frames = syntheticPerformance({.frames = 90});
  protocol::TakeWriterOptions options;
  options.commit_interval_ms = 10;
  protocol::TakeWriter writer(path("live.take"), protocol::TakeHeader(), options);
  for (const LandmarkFrame& frame : frames) ASSERT_TRUE(writer.append(frame, "webcam").ok());
  for (int i = 0; i < 500 && writer.counters().committed < frames.size(); ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  ASSERT_EQ(writer.counters().committed, frames.size());

  const Finished run = volto({"track", path("live.take"), "-o", output("w.csv")});  // the writer still holds the file
  EXPECT_EQ(run.status, 0) << run.err;
  EXPECT_EQ(table(readFile(output("w.csv"))).at("jawOpen").size(), frames.size());
  ASSERT_TRUE(writer.append(frames[89], "webcam").ok());  // and was not disturbed
  EXPECT_TRUE(writer.finish().ok());
}

TEST_F(Track, APersonsOwnNeutralIsTaken) {
  auto rest = syntheticPerformance({.frames = 1});
  rest.resize(60, rest[0]);
  for (std::size_t i = 0; i < rest.size(); ++i) rest[i].t_capture_ns = static_cast<std::int64_t>(i) * 16'666'667;
  const Finished run =
      volto({"track", performance(), "-o", output("w.csv"), "--neutral", write("n.csv", openFaceCsv(rest))});
  EXPECT_EQ(run.status, 0) << run.err;
  const Table weights = table(readFile(output("w.csv")));
  EXPECT_NEAR(std::strtod(weights.at("jawOpen")[0].c_str(), nullptr), syntheticJawOpen(0), 0.1);
}

}  // namespace
}  // namespace volto::test
