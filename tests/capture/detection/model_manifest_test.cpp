#include "capture/detection/model_manifest.h"

#include <fstream>
#include <system_error>

#include <gtest/gtest.h>

#include "capture/sha256.h"
#include "tests/support/test_data.h"

namespace volto::capture {
namespace {

const std::string kGood = R"({
  "name": "mine", "task": "landmarks", "file": "mine.onnx", "sha256": "",
  "input": {"width": 112, "height": 96, "channels": "RGB", "mean": [1, 2, 3], "deviation": [4, 5, 6]},
  "output": {"kind": "points", "values_per_point": 3, "unit": "pixels", "score": "logit"},
  "layout": "ibug68",
  "crop": {"right_eye": [0.3, 0.4], "left_eye": [0.7, 0.4], "nose": [0.5, 0.6], "mouth_right": [0.4, 0.7], "mouth_left": [0.6, 0.7]}
})";

std::string replaced(const std::string& what, const std::string& by) {
  std::string text = kGood;
  const std::size_t at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return text.replace(at, what.size(), by);
}

std::string errorOf(const std::string& json) {
  try {
    parseModelManifest(json, "mine.json");
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

void write(const std::filesystem::path& path, const std::string& text) {
  std::ofstream(path, std::ios::binary) << text;
}

TEST(ModelManifest, SaysWhatTheFileSays) {
  const ModelManifest m = parseModelManifest(kGood, "mine.json");
  EXPECT_EQ(m.name, "mine");
  EXPECT_EQ(m.width, 112);
  EXPECT_EQ(m.height, 96);
  EXPECT_TRUE(m.rgb);
  EXPECT_EQ(m.deviation[2], 6.0F);
  EXPECT_EQ(m.values_per_point, 3);
  EXPECT_TRUE(m.in_pixels);
  EXPECT_EQ(m.score, ModelManifest::Score::logit);
  EXPECT_EQ(m.crop[3][0], 0.4F);
}

TEST(ModelManifest, EveryShippedOneIsWellFormedAndSaysWhereToGetIt) {
  ASSERT_EQ(shippedModels().size(), 4U);
  for (const ModelManifest& m : shippedModels()) {
    EXPECT_FALSE(m.licence.empty()) << m.name;
    EXPECT_FALSE(m.get.empty()) << m.name;
    EXPECT_FALSE(m.loads.empty()) << m.name;
  }
}

TEST(ModelManifest, MistakesAreToldWithTheirPlace) {
  EXPECT_NE(errorOf(replaced("\"width\": 112", "\"width\": 1e9")).find("width"), std::string::npos);
  EXPECT_NE(errorOf(replaced("\"width\": 112", "\"width\": 12.5")).find("whole number"), std::string::npos);
  EXPECT_NE(errorOf(replaced("\"deviation\": [4, 5, 6]", "\"deviation\": [4, 0, 6]")).find("deviation"),
            std::string::npos);
  EXPECT_NE(errorOf(replaced("\"channels\"", "\"chanels\"")).find("chanels"), std::string::npos);
  EXPECT_NE(errorOf(replaced("ibug68", "ibug98")).find("ibug68, openseeface66"), std::string::npos);
  EXPECT_NE(errorOf(replaced("\"kind\": \"points\"", "\"kind\": \"yunet\"")).find("task"), std::string::npos);
  EXPECT_NE(errorOf(replaced("mine.onnx", "../../etc/passwd")).find("without a folder"), std::string::npos);
  EXPECT_NE(errorOf(replaced("[0.4, 0.7]", "[0.4, 0.1]")).find("upright"), std::string::npos);
  EXPECT_NE(errorOf(replaced("\"sha256\": \"\"", "\"sha256\": \"12ab\"")).find("sha256"), std::string::npos);
  EXPECT_NE(errorOf("{").find("mine.json"), std::string::npos);
  EXPECT_NE(errorOf("[]").find("object"), std::string::npos);
  EXPECT_NE(errorOf("").find("mine.json"), std::string::npos);
}

class ModelFolder : public ::testing::Test {
 protected:
  std::vector<std::filesystem::path> folders() const { return {dir.path()}; }
  std::string errorOfReading(const ModelFile& model, bool allow_unlisted = false) {
    try {
      readModelBytes(model, allow_unlisted);
    } catch (const InputError& error) {
      return error.what();
    }
    return "no error";
  }
  test::TemporaryDir dir;
};

TEST_F(ModelFolder, WithoutItsFileAModelIsKnownButNowhere) {
  const ModelFile model = findModel(ModelManifest::Task::landmarks, "", folders());
  EXPECT_EQ(model.manifest.name, "pfld_68");
  EXPECT_TRUE(model.path.empty());
}

TEST_F(ModelFolder, APersonsOwnManifestIsFoundByNameAndByPath) {
  write(dir / "mine.json", kGood);
  write(dir / "mine.onnx", "bytes");
  EXPECT_EQ(findModel(ModelManifest::Task::landmarks, "mine", folders()).path, dir / "mine.onnx");
  EXPECT_EQ(findModel(ModelManifest::Task::landmarks, (dir / "mine.json").string(), {}).path, dir / "mine.onnx");
  EXPECT_EQ(findModel(ModelManifest::Task::landmarks, "", folders()).manifest.name, "mine")
      << "the first that is there";
  EXPECT_THROW(findModel(ModelManifest::Task::landmarks, "yours", folders()), InputError);
  EXPECT_THROW(findModel(ModelManifest::Task::faces, (dir / "mine.json").string(), folders()), InputError);
}

TEST_F(ModelFolder, AFileWithAnotherHashIsRefusedUnlessAllowed) {
  write(dir / "pfld_68.onnx", "cut off");
  const ModelFile model = findModel(ModelManifest::Task::landmarks, "pfld_68", folders());
  const std::string error = errorOfReading(model);
  EXPECT_NE(error.find(sha256Hex("cut off").substr(0, 16)), std::string::npos) << error;
  EXPECT_NE(error.find("get it again"), std::string::npos) << error;
  EXPECT_EQ(readModelBytes(model, true), "cut off");
}

TEST_F(ModelFolder, AModelWithoutAListedHashIsRefusedWithTheHashToList) {
  write(dir / "lm_model3_opt.onnx", "unknown");
  const std::string error = errorOfReading(findModel(ModelManifest::Task::landmarks, "openseeface_66", folders()));
  EXPECT_NE(error.find(sha256Hex("unknown")), std::string::npos) << error;
}

TEST_F(ModelFolder, AnEmptyFileAFolderAndAMissingFileAreTold) {
  write(dir / "pfld_68.onnx", "");
  EXPECT_NE(errorOfReading(findModel(ModelManifest::Task::landmarks, "pfld_68", folders()), true).find("empty"),
            std::string::npos);
  ModelFile model{shippedModels()[1], dir.path()};
  EXPECT_NE(errorOfReading(model).find("folder"), std::string::npos);
  model.path = dir / "nowhere.onnx";
  EXPECT_THROW(readModelBytes(model, false), std::system_error);
}

}  // namespace
}  // namespace volto::capture
