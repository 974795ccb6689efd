#include "capture/livelink_csv.h"

#include <algorithm>
#include <cctype>
#include <functional>
#include <system_error>

#include <gtest/gtest.h>

#include "capture/csv_kind.h"
#include "tests/capture/csv_text.h"
#include "tests/support/test_data.h"

namespace volto::capture {
namespace {

constexpr const char* kOthers[] = {"HeadYaw",     "HeadPitch",   "HeadRoll",      "LeftEyeYaw",  "LeftEyePitch",
                                   "LeftEyeRoll", "RightEyeYaw", "RightEyePitch", "RightEyeRoll"};

// A Live Link file: 61 values a row, weight k of row r is (k + r) / 100.
struct LiveLinkText {
  std::vector<std::string> timecodes{"18:43:58:59.723", "18:43:59:00.725", "18:43:59:01.727"};
  std::string count_name = "BlendShapeCount";
  std::string newline = "\n";
  std::function<std::string(std::size_t row, const std::string& column, const std::string& cell)> edit;
  std::function<std::string(std::string)> spell = [](std::string name) {
    name[0] = static_cast<char>(std::toupper(name[0]));
    return name;
  };

  std::string str() const {
    std::string text = "Timecode," + count_name;
    for (const auto name : kArkitBlendshapeNames) (text += ",") += spell(std::string(name));
    for (const char* name : kOthers) (text += ",") += name;
    text += newline;
    for (std::size_t r = 0; r < timecodes.size(); ++r) {
      const auto cell = [&](const std::string& column, const std::string& value) {
        return edit ? edit(r, column, value) : value;
      };
      (text += timecodes[r] + ",") += cell(count_name, "61");
      for (std::size_t k = 0; k < kArkitBlendshapeCount; ++k) {
        (text += ",") += cell(std::string(kArkitBlendshapeNames[k]), std::to_string(0.01 * static_cast<double>(k + r)));
      }
      for (const char* name : kOthers) (text += ",") += cell(name, "0.0");
      text += newline;
    }
    return text;
  }
};

std::string complaint(const std::string& text) {
  try {
    parseLiveLinkCsv(text, "take.csv");
    return "";
  } catch (const InputError& error) {
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << "more than one line";
    return error.what();
  }
}

void expectSaid(const std::string& said, const std::string& where, const std::string& what) {
  EXPECT_EQ(said.substr(0, where.size()), where);
  EXPECT_NE(said.find(what), std::string::npos) << "says only: " << said;
}

TEST(Timecode, FramesAreSixtiethsAndTheFractionIsPartOfAFrame) {
  EXPECT_EQ(timecodeNs("00:00:00:00.000"), 0);
  EXPECT_EQ(timecodeNs("00:00:00:30"), 500'000'000);
  EXPECT_EQ(timecodeNs("00:00:00:30.600"), 510'000'000);  // not 30 frames and 600 ms
  EXPECT_EQ(timecodeNs("01:02:03:15.0"), (3600 + 120 + 3) * 1'000'000'000LL + 250'000'000);
  EXPECT_EQ(timecodeNs("0:0:1:0"), 1'000'000'000);
}

TEST(Timecode, OtherTextIsRefused) {
  for (const char* bad :
       {"", "1", "12:00:00", "24:00:00:00", "12:60:00:00", "12:00:60:00", "12:00:00:60", "12:00:00:00.",
        "12:00:00:00.1x", "12:00:00:-1", "12:00:00:00:00", "123:00:00:00", "12:00:00:00.1234567891234", "a:b:c:d"}) {
    EXPECT_FALSE(timecodeNs(bad)) << bad;
  }
}

TEST(LiveLinkCsv, WeightsAreReadByNameAndTimeStartsAtZero) {
  const auto take = parseLiveLinkCsv(LiveLinkText{}.str(), "take.csv");
  ASSERT_EQ(take.frames.size(), 3U);
  EXPECT_EQ(take.frames[0].t_capture_ns, 0);
  EXPECT_NEAR(static_cast<double>(take.frames[1].t_capture_ns), 1.002e9 / 60, 1.0);
  EXPECT_TRUE(take.observed.all());
  for (std::size_t k = 0; k < kArkitBlendshapeCount; ++k) {
    EXPECT_NEAR(take.frames[2].weights[k], 0.01 * static_cast<double>(k + 2), 1e-6) << kArkitBlendshapeNames[k];
  }
  EXPECT_EQ(take.frames[2].capture_seq, 2U);
  EXPECT_TRUE(take.report.warnings.empty());
}

TEST(LiveLinkCsv, SpellingOfNamesAndOfTheCountDoesNotMatter) {
  const auto plain = parseLiveLinkCsv(LiveLinkText{}.str(), "a");
  LiveLinkText other;
  other.count_name = "BlendshapeCount";
  other.newline = "\r\n";
  other.spell = [](std::string name) {
    std::transform(name.begin(), name.end(), name.begin(), [](unsigned char c) { return std::toupper(c); });
    return name;
  };
  const auto take = parseLiveLinkCsv("\xEF\xBB\xBF" + other.str(), "b");
  ASSERT_EQ(take.frames.size(), plain.frames.size());
  for (std::size_t i = 0; i < take.frames.size(); ++i) EXPECT_EQ(take.frames[i].weights, plain.frames[i].weights);
}

TEST(LiveLinkCsv, ShapeWithoutAColumnIsNotObserved) {
  const auto take = parseLiveLinkCsv("Timecode,JawOpen,Angry,TongueOut\n00:00:00:00.000,0.25,0.5,0.75\n", "take.csv");
  EXPECT_EQ(take.observed.count(), 2U);
  EXPECT_TRUE(take.observed[*arkitBlendshapeIndex("jawOpen")]);
  EXPECT_FLOAT_EQ(take.frames[0].weights[*arkitBlendshapeIndex("jawOpen")], 0.25F);
  EXPECT_FLOAT_EQ(take.frames[0].weights[*arkitBlendshapeIndex("tongueOut")], 0.75F);
  EXPECT_FALSE(take.frames[0].head.observed);
  EXPECT_EQ(take.frames[0].gaze.confidence, 0.0F);
}

TEST(LiveLinkCsv, EyeAnglesTurnIntoVoltosSigns) {
  LiveLinkText file;
  file.edit = [](std::size_t, const std::string& column, const std::string& cell) {
    if (column == "LeftEyeYaw") return std::string("0.2");
    if (column == "RightEyePitch") return std::string("-0.1");
    return cell;
  };
  const auto take = parseLiveLinkCsv(file.str(), "take.csv");
  EXPECT_FLOAT_EQ(take.frames[0].gaze.left.yaw_rad, -0.2F);    // the file's + is the subject's right
  EXPECT_FLOAT_EQ(take.frames[0].gaze.right.pitch_rad, 0.1F);  // the file's + is down
  EXPECT_EQ(take.frames[0].gaze.confidence, 1.0F);
  EXPECT_FALSE(take.frames[0].head.observed);
}

TEST(LiveLinkCsv, MidnightMayPass) {
  LiveLinkText file;
  file.timecodes = {"23:59:59:59.000", "00:00:00:00.000", "00:00:00:01.000"};
  const auto take = parseLiveLinkCsv(file.str(), "take.csv");
  ASSERT_EQ(take.frames.size(), 3U);
  EXPECT_NEAR(static_cast<double>(take.frames[2].t_capture_ns), 2e9 / 60, 1.0);
}

TEST(LiveLinkCsv, TimeThatRunsBackwardNamesBothTimesAndEqualTimesAreDropped) {
  LiveLinkText file;
  file.timecodes = {"10:00:00:00.000", "10:00:00:05.000", "10:00:00:04.000"};
  expectSaid(complaint(file.str()), "take.csv:4: ", "from 10:00:00:05.000 (line 3) to 10:00:00:04.000");
  file.timecodes[2] = "10:00:00:05.000";
  const auto take = parseLiveLinkCsv(file.str(), "take.csv");
  EXPECT_EQ(take.frames.size(), 2U);
  EXPECT_EQ(take.report.rows_equal_time, 1U);
}

TEST(LiveLinkCsv, RowWithoutAFaceIsALostFrame) {
  std::string text = LiveLinkText{}.str();
  text += "18:43:59:05.000,0\n18:43:59:06.000,0" + std::string(61, ',') + "\n";
  const auto take = parseLiveLinkCsv(text, "take.csv");
  ASSERT_EQ(take.frames.size(), 5U);
  EXPECT_TRUE(take.frames[2].face_present);
  EXPECT_FALSE(take.frames[3].face_present);
  EXPECT_FALSE(take.frames[4].face_present);
  EXPECT_EQ(take.frames[4].weights, ArkitWeights{});
  EXPECT_EQ(take.report.rows_lost, 2U);
  expectSaid(complaint(LiveLinkText{}.str() + "18:43:59:05.000,61\n"), "take.csv:5: ", "2 fields, the header 63");
}

TEST(LiveLinkCsv, WeightsBeyondOneAreClampedAndReported) {
  LiveLinkText file;
  file.edit = [](std::size_t row, const std::string& column, const std::string& cell) {
    return row == 1 && column == "jawOpen" ? "1.4" : row == 2 && column == "mouthClose" ? "-0.004" : cell;
  };
  const auto take = parseLiveLinkCsv(file.str(), "take.csv");
  EXPECT_EQ(take.frames[1].weights[*arkitBlendshapeIndex("jawOpen")], 1.0F);
  EXPECT_EQ(take.frames[2].weights[*arkitBlendshapeIndex("mouthClose")], 0.0F);
  ASSERT_EQ(take.report.warnings.size(), 1U);
  expectSaid(take.report.warnings[0], "take.csv:3: column 'JawOpen' holds '1.4'", "1 weight(s)");
}

TEST(LiveLinkCsv, CellsThatAreNoNumbersAreErrors) {
  for (const char* bad : {"nan", "inf", "-inf", "1e999", "", "x", "0,5"}) {
    LiveLinkText file;
    file.edit = [&](std::size_t row, const std::string& column, const std::string& cell) {
      return row == 1 && column == "eyeBlinkLeft" ? std::string(bad) : cell;
    };
    EXPECT_EQ(complaint(file.str()).substr(0, 12), "take.csv:3: ") << bad;
  }
  LiveLinkText file;
  file.edit = [](std::size_t row, const std::string& column, const std::string& cell) {
    return row == 1 && column == "HeadYaw" ? "25" : cell;
  };
  expectSaid(complaint(file.str()), "take.csv:3: column 'HeadYaw' ", "radians");
}

TEST(LiveLinkCsv, BadFilesGetOneClearLine) {
  expectSaid(complaint(""), "take.csv:1: ", "empty");
  expectSaid(complaint("a,b,c\n1,2,3\n"), "take.csv:1: ", "'Timecode'");
  expectSaid(complaint("Timecode,BlendShapeCount,a\n"), "take.csv:1: ", "none of the 52");
  expectSaid(complaint("Timecode,JawOpen\n"), "take.csv:2: ", "no complete row");
  expectSaid(complaint("Timecode,JawOpen,jawopen\n"), "take.csv:1: ", "twice");
  expectSaid(complaint("Timecode,JawOpen\n12 o'clock,0\n"), "take.csv:2: ", "12 o'clock");
  EXPECT_THROW(readLiveLinkCsv("/nowhere/take.csv"), std::system_error);
}

TEST(LiveLinkCsv, RowCutAtTheEndIsDroppedAndReported) {
  const std::string text = LiveLinkText{}.str();
  const std::size_t last_row = text.rfind('\n', text.size() - 2) + 1;
  const std::size_t last_number = text.rfind(',') + 1;
  for (std::size_t cut = last_row + 1; cut <= last_number; ++cut) {
    const auto take = parseLiveLinkCsv(std::string_view(text).substr(0, cut), "take.csv");
    ASSERT_EQ(take.frames.size(), 2U) << "cut at " << cut;
    ASSERT_TRUE(take.report.last_row_cut) << "cut at " << cut;
  }
}

TEST(LiveLinkCsv, PublicTakesAreReadWhole) {
  VOLTO_REQUIRE_DATA(data);
  const auto phone = readLiveLinkCsv(data / "takes/livelink/talking_iPhone.csv");
  EXPECT_EQ(phone.frames.size(), 3046U);
  EXPECT_TRUE(phone.observed.all());
  const double seconds = static_cast<double>(phone.frames.back().t_capture_ns) * 1e-9;
  EXPECT_NEAR(3045.0 / seconds, 59.9, 0.05);  // the rate that such takes have
  EXPECT_FLOAT_EQ(phone.frames[0].weights[*arkitBlendshapeIndex("eyeLookDownLeft")], 0.0105142975F);

  const auto network = readLiveLinkCsv(data / "takes/livelink/speech_from_audio.csv");  // extra columns, other spelling
  EXPECT_EQ(network.frames.size(), 610U);
  for (const auto& frame : network.frames) {
    for (const float weight : frame.weights) ASSERT_TRUE(weight >= 0.0F && weight <= 1.0F);
  }
}

TEST(LiveLinkCsv, GazeOfPublicTakesAgreesWithTheirLookShapes) {
  VOLTO_REQUIRE_DATA(data);
  // The same file says where the eyes look in two ways; signs must agree wherever the look is clear.
  const auto take = readLiveLinkCsv(data / "takes/livelink/MySlate_164_iPhone_cal.csv");
  const auto weight = [](const WeightFrame& frame, const char* name) {
    return frame.weights[*arkitBlendshapeIndex(name)];
  };
  std::size_t clear = 0, agree = 0;
  for (const auto& frame : take.frames) {
    const float left = weight(frame, "eyeLookOutLeft") - weight(frame, "eyeLookInLeft");
    const float up = weight(frame, "eyeLookUpLeft") - weight(frame, "eyeLookDownLeft");
    if (std::abs(left) > 0.05F) ++clear, agree += (frame.gaze.left.yaw_rad > 0) == (left > 0);
    if (std::abs(up) > 0.05F) ++clear, agree += (frame.gaze.left.pitch_rad > 0) == (up > 0);
  }
  ASSERT_GT(clear, 500U);
  EXPECT_GT(static_cast<double>(agree), 0.99 * static_cast<double>(clear));
}

TEST(CsvKind, HeaderSaysWhichProgramWroteTheFile) {
  EXPECT_EQ(csvKind(test::OpenFaceText{}.str()), CsvKind::openface);
  EXPECT_EQ(csvKind("frame,timestamp,confidence,success,pose_Rx,AU01_r\n"), CsvKind::openface);
  EXPECT_EQ(csvKind(LiveLinkText{}.str()), CsvKind::live_link);
  EXPECT_EQ(csvKind("\xEF\xBB\xBFtimecode,blendshapecount\r\n"), CsvKind::live_link);
  EXPECT_EQ(csvKind("timestamp,eyeBlinkLeft\n"), CsvKind::unknown);
  EXPECT_EQ(csvKind(""), CsvKind::unknown);
  EXPECT_EQ(csvKind(std::string("SQLite format 3\0", 16)), CsvKind::unknown);
}

}  // namespace
}  // namespace volto::capture
