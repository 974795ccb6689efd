#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <stdexcept>
#include <system_error>
#include <zlib.h>

#include <gtest/gtest.h>
#include <png.h>

#include "tests/support/test_data.h"
#include "tools/picture/contact_sheet.h"
#include "tools/picture/palette.h"
#include "tools/picture/plots.h"
#include "tools/picture/png.h"
#include "tools/picture/text.h"

namespace volto::picture {
namespace {

// Colours that neither a palette nor a filter likes.
Picture noise(int width, int height, std::uint32_t seed) {
  Picture picture(width, height);
  for (auto& byte : picture.rgb) byte = static_cast<std::uint8_t>((seed = seed * 1664525U + 1013904223U) >> 24);
  return picture;
}

// As libpng reads the bytes (of an animated PNG: its first frame).
Picture readBack(const std::vector<std::byte>& bytes) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  EXPECT_NE(png_image_begin_read_from_memory(&image, bytes.data(), bytes.size()), 0) << image.message;
  image.format = PNG_FORMAT_RGB;
  Picture picture(static_cast<int>(image.width), static_cast<int>(image.height));
  EXPECT_NE(png_image_finish_read(&image, nullptr, picture.rgb.data(), 0, nullptr), 0) << image.message;
  return picture;
}

// A second, independent reader of animated PNG files: every frame as a viewer would show it.
struct Animation {
  std::vector<Picture> frames;
  std::vector<double> delay_s;
};
Animation readAnimation(const std::vector<std::byte>& bytes) {
  const auto number = [&](std::size_t at) {
    std::uint32_t value = 0;
    for (std::size_t k = 0; k < 4; ++k) value = value << 8 | std::to_integer<std::uint32_t>(bytes[at + k]);
    return value;
  };
  Animation animation;
  std::vector<Colour> palette;
  std::vector<std::uint8_t> alpha;
  Picture shown;
  std::uint32_t part[4]{}, sequence = 0, announced = 0;
  bool over = false;
  for (std::size_t at = 8; at + 12 <= bytes.size();) {
    const std::size_t size = number(at), data = at + 8;
    const std::string type(reinterpret_cast<const char*>(bytes.data()) + at + 4, 4);
    const auto checksum = crc32(0, reinterpret_cast<const Bytef*>(bytes.data()) + at + 4, static_cast<uInt>(size + 4));
    EXPECT_EQ(number(data + size), static_cast<std::uint32_t>(checksum)) << type;
    if (type == "IHDR") shown = Picture(static_cast<int>(number(data)), static_cast<int>(number(data + 4)));
    if (type == "acTL") announced = number(data);
    if (type == "PLTE") {
      for (std::size_t i = 0; i < size; i += 3) {
        palette.push_back({std::to_integer<std::uint8_t>(bytes[data + i]),
                           std::to_integer<std::uint8_t>(bytes[data + i + 1]),
                           std::to_integer<std::uint8_t>(bytes[data + i + 2])});
      }
    }
    if (type == "tRNS") {
      for (std::size_t i = 0; i < size; ++i) alpha.push_back(std::to_integer<std::uint8_t>(bytes[data + i]));
    }
    if (type == "fcTL") {
      EXPECT_EQ(number(data), sequence++);
      for (std::size_t k = 0; k < 4; ++k) part[k] = number(data + 4 + 4 * k);
      const std::uint32_t delay = number(data + 20);
      animation.delay_s.push_back(static_cast<double>(delay >> 16) / static_cast<double>(delay & 0xFFFF));
      over = bytes[data + 25] == std::byte{1};
    }
    if (type == "IDAT" || type == "fdAT") {
      std::size_t skip = 0;
      if (type == "fdAT") {
        EXPECT_EQ(number(data), sequence++);
        skip = 4;
      }
      std::vector<std::uint8_t> rows(part[1] * (part[0] + 1));
      uLongf got = rows.size();
      EXPECT_EQ(uncompress(rows.data(), &got, reinterpret_cast<const Bytef*>(bytes.data()) + data + skip, size - skip),
                Z_OK);
      EXPECT_EQ(got, rows.size());
      for (std::uint32_t y = 0; y < part[1]; ++y) {
        for (std::uint32_t x = 0; x < part[0]; ++x) {
          const std::uint8_t index = rows[y * (part[0] + 1) + 1 + x];
          if (over && alpha[index] == 0) continue;
          shown.set(static_cast<int>(part[2] + x), static_cast<int>(part[3] + y), palette[index]);
        }
      }
      animation.frames.push_back(shown);
    }
    at = data + size + 4;
  }
  EXPECT_EQ(announced, animation.frames.size());
  return animation;
}

double meanDifference(const Picture& a, const Picture& b) {
  EXPECT_EQ(a.rgb.size(), b.rgb.size());
  double sum = 0.0;
  for (std::size_t i = 0; i < a.rgb.size(); ++i) sum += std::abs(a.rgb[i] - b.rgb[i]);
  return sum / static_cast<double>(a.rgb.size());
}

// A disc that moves over a soft ground.
std::vector<Picture> movingDisc(int count) {
  std::vector<Picture> frames;
  for (int f = 0; f < count; ++f) {
    Picture picture(96, 64);
    for (int y = 0; y < 64; ++y) {
      for (int x = 0; x < 96; ++x)
        picture.set(x, y, {static_cast<std::uint8_t>(40 + x / 2), static_cast<std::uint8_t>(40 + y), 80});
    }
    drawDisc(picture, 20.0F + 6.0F * static_cast<float>(f), 30.0F, 12.0F, {230, 150, 120});
    frames.push_back(picture);
  }
  return frames;
}

TEST(Png, LibpngReadsBackTheSamePixels) {
  for (const auto& [width, height] : {std::pair{1, 1}, {7, 5}, {256, 3}, {63, 64}}) {
    const Picture picture = noise(width, height, 5);
    const Picture back = readBack(encodePng(picture));
    EXPECT_EQ(back.width, width);
    EXPECT_EQ(back.rgb, picture.rgb);
  }
}

TEST(Png, SamePictureGivesTheSameBytes) { EXPECT_EQ(encodePng(noise(40, 30, 1)), encodePng(noise(40, 30, 1))); }

TEST(Png, FileIsWrittenWholeOverAnOldOne) {
  const test::TemporaryDir folder;
  std::ofstream(folder / "a.png") << "old";
  writePng(folder / "a.png", noise(9, 9, 2));
  std::ifstream file(folder / "a.png", std::ios::binary);
  const std::string text((std::istreambuf_iterator<char>(file)), {});
  std::vector<std::byte> bytes(text.size());
  std::memcpy(bytes.data(), text.data(), text.size());
  EXPECT_EQ(bytes, encodePng(noise(9, 9, 2)));
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1);
}

TEST(Png, PathThatCannotBeWrittenIsNamedAndLeavesNothingBehind) {
  const test::TemporaryDir folder;
  try {
    writePng(folder / "no/such/folder/a.png", noise(9, 9, 2));
    FAIL();
  } catch (const std::system_error& error) {
    EXPECT_EQ(error.code().value(), ENOENT);
    EXPECT_NE(std::string(error.what()).find("no/such/folder/a.png: cannot be written"), std::string::npos)
        << error.what();
  }
  std::filesystem::create_directory(folder / "taken.png");  // a folder is in the way
  EXPECT_THROW(writePng(folder / "taken.png", noise(9, 9, 2)), std::system_error);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1);
}

TEST(Picture, ImpossibleSizesAreRefused) {
  for (const auto& [width, height] : {std::pair{0, 5}, {5, -1}, {100'000, 2}})
    EXPECT_THROW(Picture(width, height), std::invalid_argument);
  EXPECT_THROW(encodePng(Picture{}), std::invalid_argument);
}

TEST(Apng, EveryFrameIsShownAsItWasDrawn) {
  const auto frames = movingDisc(8);
  const auto animation = readAnimation(encodeApng(frames, 25.0));
  ASSERT_EQ(animation.frames.size(), 8U);
  for (std::size_t f = 0; f < frames.size(); ++f) {
    EXPECT_LT(meanDifference(animation.frames[f], frames[f]), 2.5) << f;  // the palette's loss
    EXPECT_NEAR(animation.delay_s[f], 0.04, 1e-6);
  }
  EXPECT_GT(meanDifference(animation.frames[0], frames[7]), 4.0) << "frames that hardly differ would prove nothing";
}

TEST(Apng, ProgramThatKnowsNoAnimationShowsTheFirstFrame) {
  const auto frames = movingDisc(3);
  EXPECT_LT(meanDifference(readBack(encodeApng(frames, 30.0)), frames[0]), 2.5);
}

TEST(Apng, OnlyWhatChangesCostsBytes) {
  const std::vector<Picture> still(20, movingDisc(1)[0]);
  const auto one = encodeApng(std::span(still).first(1), 30.0).size(), twenty = encodeApng(still, 30.0).size();
  EXPECT_LT(twenty, one + 20 * 100);
  EXPECT_EQ(readAnimation(encodeApng(still, 30.0)).frames.size(), 20U);
}

TEST(Apng, BadInputIsRefused) {
  const auto frames = movingDisc(2);
  EXPECT_THROW(encodeApng({}, 30.0), std::invalid_argument);
  EXPECT_THROW(encodeApng(frames, 0.0), std::invalid_argument);
  EXPECT_THROW(encodeApng(frames, std::nan("")), std::invalid_argument);
  EXPECT_THROW(encodeApng(frames, 30.0, {0, 256}), std::invalid_argument);
  EXPECT_THROW(encodeApng(std::vector{Picture(4, 4), Picture(4, 5)}, 30.0), std::invalid_argument);
}

TEST(Palette, FewColoursAreKeptExactly) {
  Picture picture(16, 16, {10, 20, 30});
  fillRectangle(picture, 4, 4, 5, 5, {200, 100, 50});
  const auto palette = choosePalette(std::vector{picture}, 64);
  EXPECT_EQ(palette.size(), 2U);
  EXPECT_TRUE(std::find(palette.begin(), palette.end(), Colour{200, 100, 50}) != palette.end());
}

TEST(Text, LettersStayInsideTheirWidthAndDiffer) {
  const TextStyle style{20.0F, {255, 255, 255}};
  std::vector<std::vector<std::uint8_t>> seen;
  for (char c = '!'; c <= '~'; ++c) {
    Picture picture(60, 60);
    drawText(picture, 10.0F, 40.0F, std::string(1, c), style);
    int first = 60, last = -1;
    for (int y = 0; y < 60; ++y) {
      for (int x = 0; x < 60; ++x) {
        if (picture.at(x, y).r > 0) first = std::min(first, x), last = std::max(last, x);
      }
    }
    ASSERT_GE(last, 0) << c << " draws nothing";
    EXPECT_GE(first, 7) << c;
    EXPECT_LE(last, 10 + textWidth(std::string(1, c), style) + 3) << c;
    for (const auto& other : seen) EXPECT_NE(other, picture.rgb) << c << " looks like another letter";
    seen.push_back(picture.rgb);
  }
}

TEST(Text, DrawingOverTheEdgeOrForeignBytesDoNotHarm) {
  Picture picture(10, 10);
  drawText(picture, -1000.0F, 5.0F, "far away");
  drawText(picture, 5.0F, 1e9F, "far away");
  drawText(picture, 0.0F, 9.0F, "\xC3\xA4\xFF");
  drawLine(picture, -1e9F, 0, std::nanf(""), 5, {1, 2, 3});
  EXPECT_EQ(fittingText("a long caption", 30.0F).substr(0, 1), "a");
  EXPECT_LE(textWidth(fittingText("a long caption", 30.0F)), 30.0F);
}

TEST(ContactSheet, CellsLieInOrderRowByRow) {
  const std::vector<Cell> cells{
      {Picture(20, 20, {200, 0, 0}), "one"}, {Picture(20, 20, {0, 200, 0}), "two"}, {Picture(10, 10, {0, 0, 200}), ""}};
  SheetStyle style;
  style.title = "three cells";
  const Picture sheet = contactSheet(cells, 2, style);
  const auto find = [&](Colour c) {
    for (int y = 0; y < sheet.height; ++y) {
      for (int x = 0; x < sheet.width; ++x) {
        if (sheet.at(x, y) == c) return std::pair{x, y};
      }
    }
    return std::pair{-1, -1};
  };
  const auto red = find({200, 0, 0}), green = find({0, 200, 0}), blue = find({0, 0, 200});
  EXPECT_EQ(red.second, green.second);
  EXPECT_LT(red.first, green.first);
  EXPECT_GT(blue.second, red.second + 20);
  EXPECT_EQ(blue.first, red.first + 5);  // in the middle of its cell
  EXPECT_THROW(contactSheet({}, 2), std::invalid_argument);
  EXPECT_THROW(contactSheet(cells, 0), std::invalid_argument);
}

TEST(Plots, CurveIsDrawnWhereItsValuesAre) {
  CurvePlot plot;
  for (int i = 0; i <= 100; ++i) plot.time_s.push_back(0.01 * i);
  plot.curves.push_back({"jawOpen", std::vector<float>(101, 0.25F), Colour{255, 0, 0}});
  const Picture picture = plotCurves(plot, 300, 200);
  int red_row = -1, rows = 0;
  for (int y = 0; y < 200; ++y) {
    if (picture.at(120, y).r > 180 && picture.at(120, y).g < 80) red_row = y, ++rows;
  }
  ASSERT_GE(red_row, 0);
  EXPECT_LE(rows, 3);
  EXPECT_NEAR(static_cast<double>(red_row), 12.0 + 0.75 * (200.0 - 22.0 - 12.0), 3.0);
  plot.curves[0].values.pop_back();
  EXPECT_THROW(plotCurves(plot, 300, 200), std::invalid_argument);
  EXPECT_THROW(plotStrips(plot, 300), std::invalid_argument);
}

TEST(Plots, GapsEmptyPlotsAndOddValuesDoNotHarm) {
  const float nan = std::nanf(""), inf = std::numeric_limits<float>::infinity();
  CurvePlot plot{"title", {0, 1, 2, 3}, {{"a", {nan, 1, inf, -inf}, {}}, {"b", {0, 0, 0, 0}, {}}}, 0, 0, 1.5};
  EXPECT_EQ(plotCurves(plot, 200, 100).width, 200);
  EXPECT_EQ(plotStrips(plot, 200).width, 200);
  EXPECT_EQ(plotCurves({}, 50, 40).height, 40);
  EXPECT_EQ(plotStrips({}, 50).width, 50);
  plot.time_s = {1, 1, 1, 1};
  plotCurves(plot, 200, 100);
}

TEST(Plots, LiveliestCurvesComeFirst) {
  const std::vector<Curve> curves{
      {"still", {0.5F, 0.5F, 0.5F}, {}}, {"lively", {0.0F, 1.0F, 0.0F}, {}}, {"calm", {0.0F, 0.2F, 0.0F}, {}}};
  EXPECT_EQ(liveliestCurves(curves, 2), (std::vector<std::size_t>{1, 2}));
}

TEST(Plots, LandmarksAreDrawnWhereTheyLieAndALostFaceSaysSo) {
  LandmarkFrame frame;
  frame.face_present = true;
  frame.points_px.assign(68, {320.0F, 240.0F});
  for (std::size_t i = 0; i < 17; ++i) frame.points_px[i] = {100.0F + 20.0F * static_cast<float>(i), 400.0F};
  const ImageArea area{0, 0, 640, 480};
  const Picture picture = plotLandmarks(frame, 320, 240, area);
  EXPECT_GT(picture.at(50, 200).r, 200);   // landmark 0
  EXPECT_GT(picture.at(160, 120).r, 200);  // all the others
  EXPECT_LT(picture.at(20, 20).r, 60);
  const ImageArea fitted = areaOf(std::vector{frame});
  EXPECT_LT(fitted.left, 100.0F);
  EXPECT_GT(fitted.right, 420.0F);
  frame.face_present = false;
  EXPECT_NE(plotLandmarks(frame, 320, 240, area).rgb, Picture(320, 240, picture.at(0, 0)).rgb);
}

}  // namespace
}  // namespace volto::picture
