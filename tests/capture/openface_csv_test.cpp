#include "capture/openface_csv.h"

#include <cmath>
#include <fstream>
#include <system_error>

#include <gtest/gtest.h>

#include "tests/capture/csv_text.h"
#include "tests/support/test_data.h"

namespace volto::capture {
namespace {

using test::OpenFaceText;

// The one line that a reader says about `text`; empty when it accepts it.
std::string complaint(const std::string& text) {
  try {
    parseOpenFaceCsv(text, "take.csv");
    return "";
  } catch (const InputError& error) {
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << "more than one line";
    return error.what();
  }
}

auto setCell(int row, const std::string& column, const std::string& text) {
  return [=](int r, const std::string& c, const std::string& cell) { return r == row && c == column ? text : cell; };
}

void expectSaid(const std::string& said, const std::string& where, const std::string& what) {
  EXPECT_EQ(said.substr(0, where.size()), where);
  EXPECT_NE(said.find(what), std::string::npos) << "says only: " << said;
}

TEST(OpenFaceCsv, PointsAreReadByNameWithLeadingBlanks) {
  OpenFaceText file;
  file.with_3d = true;
  const auto take = parseOpenFaceCsv(file.str(), "take.csv");
  ASSERT_EQ(take.frames.size(), 3U);
  EXPECT_TRUE(take.has_3d);
  const LandmarkFrame& second = take.frames[1];
  EXPECT_EQ(second.t_capture_ns, 10'000'000);
  EXPECT_EQ(second.capture_seq, 2U);
  EXPECT_TRUE(second.face_present);
  EXPECT_FLOAT_EQ(second.confidence, 0.98F);
  ASSERT_EQ(second.points_px.size(), 68U);
  EXPECT_FLOAT_EQ(second.points_px[67][0], 167.5F);
  EXPECT_FLOAT_EQ(second.points_px[67][1], 334.5F);
  ASSERT_EQ(second.points_camera_mm.size(), 68U);
  EXPECT_FLOAT_EQ(second.points_camera_mm[30][0], 1300.0F);
  EXPECT_FLOAT_EQ(second.points_camera_mm[30][1], 2600.0F);
  EXPECT_FLOAT_EQ(second.points_camera_mm[30][2], 1000.0F);
  EXPECT_TRUE(take.report.warnings.empty());
}

TEST(OpenFaceCsv, ColumnOrderDoesNotMatter) {
  // The same file with its columns in reverse order.
  const std::string text = OpenFaceText{}.str();
  std::string reversed;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = text.find('\n', begin);
    std::string line = text.substr(begin, end - begin), turned;
    for (std::size_t comma; (comma = line.rfind(", ")) != std::string::npos; line.resize(comma)) {
      turned += line.substr(comma + 2) + ", ";
    }
    reversed += turned + line + "\n";
    begin = end + 1;
  }
  const auto a = parseOpenFaceCsv(text, "a"), b = parseOpenFaceCsv(reversed, "b");
  ASSERT_EQ(a.frames.size(), b.frames.size());
  for (std::size_t i = 0; i < a.frames.size(); ++i) EXPECT_EQ(a.frames[i].points_px, b.frames[i].points_px);
}

TEST(OpenFaceCsv, ByteOrderMarkCrLfMissingFinalNewlineAndEmptyLinesAreFine) {
  OpenFaceText file;
  file.newline = "\r\n";
  const auto plain = parseOpenFaceCsv(OpenFaceText{}.str(), "plain");
  std::string text = "\xEF\xBB\xBF" + file.str();
  text.resize(text.size() - 2);
  const auto take = parseOpenFaceCsv(text, "take.csv");
  ASSERT_EQ(take.frames.size(), 3U);
  EXPECT_EQ(take.frames[2].points_px, plain.frames[2].points_px);
  EXPECT_FALSE(take.report.last_row_cut);
  EXPECT_EQ(parseOpenFaceCsv(OpenFaceText{}.str() + "\n\n", "take.csv").frames.size(), 3U);
}

TEST(OpenFaceCsv, RowCutAtTheEndIsDroppedAndReportedWhereverTheCutFalls) {
  const std::string text = OpenFaceText{}.str();
  const std::size_t last_row = text.rfind('\n', text.size() - 2) + 1;
  // Up to the comma before the last number every cut is noticed; inside the last number only a person could tell.
  const std::size_t last_number = text.rfind(' ') + 1;
  for (std::size_t cut = last_row + 1; cut <= last_number; ++cut) {
    const auto take = parseOpenFaceCsv(std::string_view(text).substr(0, cut), "take.csv");
    ASSERT_EQ(take.frames.size(), 2U) << "cut at " << cut;
    ASSERT_TRUE(take.report.last_row_cut) << "cut at " << cut;
    ASSERT_EQ(take.report.warnings.size(), 1U);
    expectSaid(take.report.warnings[0], "take.csv:4: ", "middle of this row");
  }
}

TEST(OpenFaceCsv, CutInTheHeaderOrTheFirstRowIsAnError) {
  const std::string text = OpenFaceText{}.str();
  const std::size_t header_end = text.find('\n');
  for (std::size_t cut = 1; cut < header_end; cut += 7) {
    EXPECT_EQ(complaint(text.substr(0, cut)).substr(0, 11), "take.csv:1:") << "cut at " << cut;
  }
  expectSaid(complaint(text.substr(0, header_end + 1)), "take.csv:2: ", "no complete row");
  expectSaid(complaint(text.substr(0, header_end + 40)), "take.csv:2: ", "no complete row");
}

TEST(OpenFaceCsv, MissingFileSaysWhichAndIsNotBadData) {
  try {
    readOpenFaceCsv("/nowhere/take.csv");
    FAIL();
  } catch (const std::system_error& error) {
    EXPECT_EQ(error.code().value(), ENOENT);
    EXPECT_EQ(std::string(error.what()).substr(0, 16), "/nowhere/take.cs");
  }
  EXPECT_THROW(readOpenFaceCsv(test::TemporaryDir().path()), std::system_error);  // a folder
}

TEST(OpenFaceCsv, FilesThatAreNoCsvAreRefusedAtOnce) {
  expectSaid(complaint(""), "take.csv:1: ", "empty");
  expectSaid(complaint("\n\n \n"), "take.csv:1: ", "no text");
  std::string noise;
  std::uint32_t state = 1;
  for (int i = 0; i < 200'000; ++i) noise += static_cast<char>((state = state * 1664525U + 1013904223U) >> 24);
  expectSaid(complaint(noise), "take.csv:1: ", "not a");
  expectSaid(complaint("\x89PNG\r\n\x1a\n"), "take.csv:1: ", "0x89");
  expectSaid(complaint("SQLite format 3" + std::string(100, '\0')), "take.csv:1: ", "SQLite");
  expectSaid(complaint("hello, world\n1, 2\n"), "take.csv:1: ", "is this an OpenFace CSV file?");
  expectSaid(complaint(std::string("\xFF\xFE") + std::string("f\0r\0", 4)), "take.csv:1: ", "UTF-16");
  expectSaid(complaint(std::string("\xFE\xFF\0f\0r", 6)), "take.csv:1: ", "UTF-16");
  expectSaid(complaint(std::string("f\0r\0a\0m\0", 8)), "take.csv:1: ", "UTF-16");
}

TEST(OpenFaceCsv, NulByteIsNamedWithItsLine) {
  std::string text = OpenFaceText{}.str();
  text[text.find('\n', text.find('\n') + 1) + 5] = '\0';
  expectSaid(complaint(text), "take.csv:3: ", "NUL");
}

TEST(OpenFaceCsv, LineOver64KiBIsRefusedWithoutReadingOn) {
  expectSaid(complaint(std::string(10'000'000, 'a')), "take.csv:1: ", "64 KiB");
  const std::string one_line = OpenFaceText{}.str() + std::string(70'000, '1');
  expectSaid(complaint(one_line), "take.csv:5: ", "64 KiB");
}

TEST(OpenFaceCsv, FileWithActionUnitsAloneIsSaidToHaveNoLandmarks) {
  const std::string said =
      complaint("frame,timestamp,confidence,success,pose_Rx,AU01_r,AU02_r\n0,0.0,0.98,1,0.1,0.2,0.3\n");
  expectSaid(said, "take.csv:1: ", "no landmarks (2 action unit columns only)");
}

TEST(OpenFaceCsv, WrongNumberOfPointsIsRefused) {
  OpenFaceText file;
  file.points = 67;
  expectSaid(complaint(file.str()), "take.csv:1: ", "67 columns 'x_*', 68 are needed ('x_67' is missing)");
  file.points = 69;
  expectSaid(complaint(file.str()), "take.csv:1: ", "'x_68' is one point too many");
  file.points = 68;
  std::string text = file.str();
  text.replace(text.find("y_10"), 4, "y_11");
  expectSaid(complaint(text), "take.csv:1: ", "'y_11' is there twice");
  text = file.str();
  text.replace(text.find("timestamp"), 9, "timestump");
  expectSaid(complaint(text), "take.csv:1: ", "'timestamp'");
}

TEST(OpenFaceCsv, RowWithTooFewOrTooManyFieldsIsNamed) {
  OpenFaceText file;
  file.edit = setCell(1, "x_5", "1.0, 2.0");
  expectSaid(complaint(file.str()), "take.csv:3: ", "142 fields, the header 141");
  std::string text = OpenFaceText{}.str();
  text.erase(text.rfind(','), text.size() - 1 - text.rfind(','));
  expectSaid(complaint(text), "take.csv:4: ", "140 fields, the header 141");
}

TEST(OpenFaceCsv, SemicolonsDecimalCommasAndQuotesAreNamedOnce) {
  OpenFaceText file;
  file.separator = ";";
  expectSaid(complaint(file.str()), "take.csv:1: ", "separated by ';'");
  file.separator = "\t";
  expectSaid(complaint(file.str()), "take.csv:1: ", "separated by a tab");
  file.separator = ",";
  file.edit = [](int, const std::string&, std::string cell) {
    if (const auto dot = cell.find('.'); dot != std::string::npos) cell[dot] = ',';
    return cell;
  };
  expectSaid(complaint(file.str()), "take.csv:2: ", "decimal comma");
  file.edit = setCell(0, "x_5", "\"1,5\"");
  expectSaid(complaint(file.str()), "take.csv:2: ", "quotes");
}

TEST(OpenFaceCsv, PointThatIsNoNumberIsAnErrorWithAFaceAndALostFrameWithout) {
  for (const std::string bad : {"nan", "-nan", "inf", "-inf", "1e999", "", "1e20"}) {
    OpenFaceText file;
    file.edit = setCell(1, "y_33", bad);
    expectSaid(complaint(file.str()), "take.csv:3: column 'y_33' ", bad.empty() ? "is empty" : "'" + bad + "'");

    file.edit = [&](int row, const std::string& column, const std::string& cell) {
      if (row != 1) return cell;
      return column == "success" ? std::string("0") : column == "y_33" ? bad : cell;
    };
    const auto take = parseOpenFaceCsv(file.str(), "take.csv");
    ASSERT_EQ(take.frames.size(), 3U) << bad;
    EXPECT_FALSE(take.frames[1].face_present);
    EXPECT_TRUE(take.frames[1].points_px.empty());
    EXPECT_TRUE(take.frames[0].face_present && take.frames[2].face_present);
    EXPECT_EQ(take.report.rows_lost, 1U);
  }
}

TEST(OpenFaceCsv, TextInPlaceOfANumberIsAlwaysAnError) {
  for (const char* bad : {"abc", "1.2.3", "0x1F", "12px", "--3", "+-3"}) {
    OpenFaceText file;
    file.edit = [&](int row, const std::string& column, const std::string& cell) {
      if (row != 1) return cell;
      return column == "success" ? std::string("0") : column == "x_0" ? std::string(bad) : cell;
    };
    expectSaid(complaint(file.str()), "take.csv:3: column 'x_0' ", bad);
  }
}

TEST(OpenFaceCsv, NonFinite3dPointIsAnErrorToo) {
  OpenFaceText file;
  file.with_3d = true;
  file.edit = setCell(2, "Z_1", "nan");
  expectSaid(complaint(file.str()), "take.csv:4: column 'Z_1' ", "nan");
}

TEST(OpenFaceCsv, TimeThatRunsBackwardNamesBothTimesAndTheLine) {
  OpenFaceText file;
  file.edit = setCell(2, "timestamp", "0.005");
  const std::string said = complaint(file.str());
  expectSaid(said, "take.csv:4: ", "from 0.01 s (line 3) to 0.005 s");
}

TEST(OpenFaceCsv, RowsWithEqualTimesAreDroppedAndCounted) {
  OpenFaceText file;
  file.rows = 4;
  file.edit = [](int row, const std::string& column, const std::string& cell) {
    return column == "timestamp" && (row == 1 || row == 2) ? "0.00" : cell;
  };
  const auto take = parseOpenFaceCsv(file.str(), "take.csv");
  EXPECT_EQ(take.frames.size(), 2U);
  EXPECT_EQ(take.report.rows_equal_time, 2U);
  ASSERT_EQ(take.report.warnings.size(), 1U);
  expectSaid(take.report.warnings[0], "take.csv:3: 2 row(s)", "same time");
}

TEST(OpenFaceCsv, NegativeAndAbsurdTimesAreErrors) {
  for (const char* bad : {"-0.5", "1e12", "nan", "inf", "", "soon"}) {
    OpenFaceText file;
    file.edit = setCell(1, "timestamp", bad);
    EXPECT_EQ(complaint(file.str()).substr(0, 12), "take.csv:3: ") << bad;
  }
}

TEST(OpenFaceCsv, OutOfRangeMetaColumnsAreErrors) {
  for (const auto& [column, bad] : {std::pair{"success", "2"},
                                    {"success", ""},
                                    {"confidence", "98"},
                                    {"confidence", "nan"},
                                    {"frame", "-1"},
                                    {"frame", "1.5"},
                                    {"frame", "1e300"}}) {
    OpenFaceText file;
    file.edit = setCell(1, column, bad);
    EXPECT_EQ(complaint(file.str()).substr(0, 12), "take.csv:3: ") << column << " " << bad;
  }
}

TEST(OpenFaceCsv, OnlyTheFirstFaceOfSeveralIsFollowed) {
  OpenFaceText file;
  file.rows = 6;
  file.edit = [](int row, const std::string& column, const std::string& cell) {
    if (column == "face_id") return std::to_string(row % 2 + 3);
    if (column == "timestamp") return OpenFaceText::value(row / 2, column);
    return cell;
  };
  const auto take = parseOpenFaceCsv(file.str(), "take.csv");
  EXPECT_EQ(take.frames.size(), 3U);
  EXPECT_EQ(take.report.rows_other_faces, 3U);
  EXPECT_EQ(take.report.rows_equal_time, 0U);
}

TEST(OpenFaceCsv, GapInFrameNumbersIsKeptAndARestartIsCountedOn) {
  OpenFaceText file;
  file.rows = 4;
  file.edit = [](int row, const std::string& column, const std::string& cell) {
    const char* numbers[] = {"1", "5", "1", "2"};
    return column == "frame" ? numbers[row] : cell;
  };
  const auto take = parseOpenFaceCsv(file.str(), "take.csv");
  ASSERT_EQ(take.frames.size(), 4U);
  EXPECT_EQ(take.frames[1].capture_seq, 5U);
  EXPECT_EQ(take.frames[2].capture_seq, 6U);
  EXPECT_EQ(take.frames[3].capture_seq, 7U);
  EXPECT_EQ(take.report.warnings.size(), 1U);
}

TEST(OpenFaceCsv, NormalisedCoordinatesAreRefusedAndACollapsedFrameIsLost) {
  OpenFaceText file;
  const auto shrink = [](int only_row) {
    return [=](int row, const std::string& column, const std::string& cell) {
      const bool point = column.starts_with("x_") || column.starts_with("y_");
      return point && (only_row < 0 || row == only_row) ? std::to_string(std::stod(cell) / 1000.0) : cell;
    };
  };
  file.edit = shrink(-1);
  expectSaid(complaint(file.str()), "take.csv:", "must be in pixels");
  file.edit = shrink(1);
  const auto take = parseOpenFaceCsv(file.str(), "take.csv");
  EXPECT_FALSE(take.frames[1].face_present);
  EXPECT_EQ(take.report.warnings.size(), 1U);
}

TEST(OpenFaceCsv, FramesComeOneByOneFromAFileOfAnyLength) {
  // Longer than the reader's buffer, so that rows cross its end.
  OpenFaceText file;
  file.rows = 99;
  const test::TemporaryDir folder;
  std::ofstream(folder / "long.csv", std::ios::binary) << file.str();
  OpenFaceCsvReader reader(folder / "long.csv");
  LandmarkFrame frame;
  int count = 0;
  while (reader.next(frame)) {
    EXPECT_FLOAT_EQ(frame.points_px[10][0], 110.0F + 0.5F * static_cast<float>(count));
    ++count;
  }
  EXPECT_EQ(count, 99);
  EXPECT_FALSE(reader.next(frame));
}

TEST(OpenFaceCsv, SyntheticTakesAreReadWhole) {
  VOLTO_REQUIRE_DATA(data);
  const auto take = readOpenFaceCsv(data / "takes/synthetic/talking_person_b_30fps.openface.csv");
  EXPECT_EQ(take.frames.size(), 1523U);
  EXPECT_TRUE(take.has_3d);
  EXPECT_TRUE(take.report.warnings.empty());
  const LandmarkFrame& first = take.frames.front();
  EXPECT_FLOAT_EQ(first.points_px[0][0], 226.267F);
  // The 3D points project onto the 2D points with the camera that the data's description names: 640 x 480, focal length
  // 800 px.
  for (const LandmarkFrame& frame : take.frames) {
    for (std::size_t i = 0; i < 68; ++i) {
      const auto& p = frame.points_camera_mm[i];
      ASSERT_NEAR(800.0 * p[0] / p[2] + 320.0, frame.points_px[i][0], 2.5);
      ASSERT_NEAR(800.0 * p[1] / p[2] + 240.0, frame.points_px[i][1], 2.5);
    }
  }
}

TEST(OpenFaceCsv, PublicFilesWithActionUnitsAloneAreExplained) {
  VOLTO_REQUIRE_DATA(data);
  try {
    readOpenFaceCsv(data / "takes/openface/demo.csv");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("no landmarks (17 action unit columns only)"), std::string::npos)
        << error.what();
  }
}

}  // namespace
}  // namespace volto::capture
