#include "tools/pipeline/profile_file.h"

#include <fstream>
#include <system_error>

#include <gtest/gtest.h>

#include "capture/errors.h"
#include "tests/support/test_data.h"

namespace volto::pipeline {
namespace {

tracker::NeutralFace someFace() {
  tracker::NeutralFace face;
  for (Eigen::Index i = 0; i < face.positions_mm.rows(); ++i)
    face.positions_mm.row(i) << 0.1 * static_cast<double>(i), -1.25 * static_cast<double>(i), 1.0 / 3;
  face.confidence.fill(0.5F);
  face.usual[3] = 0.25F;
  face.deviation[3] = 0.125F;
  face.lids[1] = {0.11F, 0.06F};
  return face;
}

std::string errorOf(const std::string& text) {
  test::TemporaryDir dir;
  std::ofstream(dir / "p.json", std::ios::binary) << text;
  try {
    readProfile(dir / "p.json");
  } catch (const capture::InputError& error) {
    return error.what();
  }
  return "no error";
}

TEST(ProfileFile, ComesBackAsItWent) {
  test::TemporaryDir dir;
  const tracker::NeutralFace face = someFace();
  std::ofstream(dir / "p.json") << profileText(face);
  const tracker::NeutralFace back = readProfile(dir / "p.json");
  EXPECT_EQ(back.positions_mm, face.positions_mm);
  EXPECT_EQ(back.confidence, face.confidence);
  EXPECT_EQ(back.usual, face.usual);
  EXPECT_EQ(back.deviation, face.deviation);
  EXPECT_EQ(back.lids[1].closed, 0.06F);
}

TEST(ProfileFile, WhatIsNoProfileIsToldInOneLine) {
  std::string good = profileText(someFace());
  const auto with = [&](const std::string& what, const std::string& by) {
    std::string text = good;
    return text.replace(text.find(what), what.size(), by);
  };
  for (const std::string& bad :
       {std::string(), std::string("{}"), std::string("[1, 2"), good.substr(0, good.size() / 2),
        with("\"volto_profile\": 1", "\"volto_profile\": 2"), with("\"2.1\"", "\"2.x\""), with("0.125", "1e999"),
        with("0.25", "-3"), with("\"lids\"", "\"lads\"")}) {
    const std::string error = errorOf(bad);
    EXPECT_NE(error.find("p.json: is no profile"), std::string::npos) << error;
    EXPECT_EQ(error.find('\n'), std::string::npos) << error;
  }
  EXPECT_THROW(readProfile("/nowhere/p.json"), std::system_error);
}

}  // namespace
}  // namespace volto::pipeline
