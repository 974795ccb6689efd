#include "capture/detection/model_manifest.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <initializer_list>
#include <memory>
#include <optional>
#include <system_error>

#include <nlohmann/json.hpp>

#include "capture/sha256.h"

namespace volto::capture {

extern const char* const kYunetManifest;
extern const char* const kPfld68Manifest;
extern const char* const kOpenSeeFace66Manifest;
extern const char* const kMediaPipe478Manifest;

namespace {

using Json = nlohmann::json;

constexpr std::size_t kMaxManifestBytes = 64U << 10U;
constexpr std::size_t kMaxModelBytes = 256U << 20U;
constexpr int kMaxInputSide = 1024;
constexpr std::array<std::string_view, kFaceAnchorCount> kAnchorNames = {"right_eye", "left_eye", "nose", "mouth_right",
                                                                         "mouth_left"};

[[noreturn]] void fail(const std::string& where, const std::string& what) {
  throw InputError(std::string(where).append(": ").append(what));
}

// One object of the file; a key that nobody asked for is a mistake that must not pass in silence.
class Object {
 public:
  Object(const Json& json, std::string where, std::initializer_list<std::string_view> keys)
      : json_(json), where_(std::move(where)) {
    if (!json.is_object()) fail(where_, "is not an object");
    for (const auto& item : json.items()) {
      if (std::find(keys.begin(), keys.end(), item.key()) != keys.end()) continue;
      std::string known;
      for (const std::string_view key : keys) known.append(known.empty() ? "" : ", ").append(key);
      fail(where_, "has no key \"" + item.key() + "\"; there are: " + known);
    }
  }

  bool has(const char* key) const { return json_.contains(key); }
  const Json& at(const char* key) const {
    const auto found = json_.find(key);
    if (found == json_.end()) fail(where_, std::string("lacks \"").append(key).append("\""));
    return *found;
  }
  std::string text(const char* key) const {
    const Json& value = at(key);
    if (!value.is_string()) fail(where_, std::string("\"").append(key).append("\" is not text"));
    return value.get<std::string>();
  }
  double number(const char* key, double low, double high) const { return numberOf(at(key), key, low, high); }
  int integer(const char* key, int low, int high) const {
    const Json& value = at(key);
    if (!value.is_number_integer()) fail(where_, std::string("\"").append(key).append("\" is not a whole number"));
    return static_cast<int>(numberOf(value, key, low, high));
  }
  template <std::size_t N>
  std::array<float, N> numbers(const char* key, double low, double high) const {
    const Json& value = at(key);
    if (!value.is_array() || value.size() != N)
      fail(where_,
           std::string("\"").append(key).append("\" is not a list of ").append(std::to_string(N)).append(" numbers"));
    std::array<float, N> out{};
    for (std::size_t i = 0; i < N; ++i) out[i] = static_cast<float>(numberOf(value[i], key, low, high));
    return out;
  }
  // The index of the text among `choices`.
  std::size_t choice(const char* key, std::initializer_list<std::string_view> choices) const {
    const std::string value = text(key);
    const auto found = std::find(choices.begin(), choices.end(), value);
    if (found != choices.end()) return static_cast<std::size_t>(found - choices.begin());
    std::string known;
    for (const std::string_view c : choices) known.append(known.empty() ? "" : ", ").append(c);
    fail(where_, std::string("\"").append(key).append("\" is none of ").append(known));
  }

 private:
  double numberOf(const Json& value, const char* key, double low, double high) const {
    const double number = value.is_number() ? value.get<double>() : std::nan("");
    if (!(number >= low && number <= high)) {
      fail(where_, std::string("\"").append(key).append("\" is not a number from ") + std::to_string(low) + " to " +
                       std::to_string(high));
    }
    return number;
  }

  const Json& json_;
  std::string where_;
};

void readInput(const Json& json, const std::string& where, ModelManifest& out) {
  const Object input(json, where + ": \"input\"", {"width", "height", "any_size", "channels", "mean", "deviation"});
  out.width = input.integer("width", 16, kMaxInputSide);
  out.height = input.integer("height", 16, kMaxInputSide);
  if (input.has("any_size")) {
    if (!input.at("any_size").is_boolean()) fail(where, "\"any_size\" is neither true nor false");
    out.any_size = input.at("any_size").get<bool>();
  }
  out.rgb = input.choice("channels", {"BGR", "RGB"}) == 1;
  out.mean = input.numbers<3>("mean", 0, 255);
  out.deviation = input.numbers<3>("deviation", 1e-3, 255);
}

void readOutput(const Json& json, const std::string& where, ModelManifest& out) {
  const Object output(json, where + ": \"output\"", {"kind", "values_per_point", "unit", "score", "logit_factor"});
  out.output = static_cast<ModelManifest::Output>(output.choice("kind", {"yunet", "points", "heatmaps"}));
  const bool finds_faces = out.output == ModelManifest::Output::yunet;
  if (finds_faces != (out.task == ModelManifest::Task::faces))
    fail(where, "its output does not fit its task: faces come out as yunet, landmarks as points or heatmaps");
  if (out.output == ModelManifest::Output::points) {
    out.values_per_point = output.integer("values_per_point", 2, 8);
    out.in_pixels = output.choice("unit", {"fraction", "pixels"}) == 1;
  }
  if (output.has("score"))
    out.score = static_cast<ModelManifest::Score>(output.choice("score", {"none", "probability", "logit"}));
  if (output.has("logit_factor")) out.logit_factor = output.number("logit_factor", 0.1, 1000);
}

bool isSha256(const std::string& text) {
  return text.size() == 64 && text.find_first_not_of("0123456789abcdef") == std::string::npos;
}

}  // namespace

ModelManifest parseModelManifest(std::string_view json, const std::string& name) {
  Json root;
  try {
    root = Json::parse(json);
  } catch (const Json::exception& error) {
    fail(name, std::string("is no model manifest: ") + error.what());
  }
  const Object top(root, name,
                   {"name", "task", "file", "sha256", "input", "output", "layout", "crop", "licence", "get", "loads"});
  ModelManifest out;
  out.name = top.text("name");
  out.task = static_cast<ModelManifest::Task>(top.choice("task", {"faces", "landmarks"}));
  out.file = top.text("file");
  if (out.file.empty() || out.file.find('/') != std::string::npos)
    fail(name, "\"file\" is a file's name without a folder");
  out.sha256 = top.text("sha256");
  if (!out.sha256.empty() && !isSha256(out.sha256)) fail(name, "\"sha256\" is not 64 lower-case hexadecimal digits");
  for (const auto& [key, text] : {std::pair{"licence", &out.licence}, {"get", &out.get}, {"loads", &out.loads}})
    if (top.has(key)) *text = top.text(key);
  readInput(top.at("input"), name, out);
  readOutput(top.at("output"), name, out);
  if (out.task == ModelManifest::Task::faces) return out;

  out.layout = static_cast<LandmarkLayout>(top.choice("layout", {"ibug68", "openseeface66", "mediapipe478"}));
  const Object crop(top.at("crop"), name + ": \"crop\"",
                    {kAnchorNames[0], kAnchorNames[1], kAnchorNames[2], kAnchorNames[3], kAnchorNames[4]});
  for (std::size_t i = 0; i < kFaceAnchorCount; ++i)
    out.crop[i] = crop.numbers<2>(std::string(kAnchorNames[i]).c_str(), 0, 1);
  const float across = out.crop[1][0] - out.crop[0][0];
  const float down = 0.5F * (out.crop[3][1] + out.crop[4][1] - out.crop[0][1] - out.crop[1][1]);
  if (!(across > 0.05F && down > 0.05F))
    fail(name, "\"crop\" is no upright face: the subject's right eye lies on the left, the mouth below the eyes");
  return out;
}

ModelManifest readModelManifest(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw std::system_error(errno, std::generic_category(), path.string());
  std::string text(kMaxManifestBytes + 1, '\0');
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(file.gcount()));
  if (text.size() > kMaxManifestBytes) fail(path.string(), "is no model manifest: larger than 64 KiB");
  return parseModelManifest(text, path.string());
}

const std::vector<ModelManifest>& shippedModels() {
  static const std::vector<ModelManifest> models = {
      parseModelManifest(kYunetManifest, "yunet.json"),
      parseModelManifest(kPfld68Manifest, "pfld_68.json"),
      parseModelManifest(kOpenSeeFace66Manifest, "openseeface_66.json"),
      parseModelManifest(kMediaPipe478Manifest, "mediapipe_478.json"),
  };
  return models;
}

namespace {

std::filesystem::path findFile(const std::string& name, const std::vector<std::filesystem::path>& folders) {
  std::error_code ignored;
  for (const std::filesystem::path& folder : folders)
    if (std::filesystem::is_regular_file(folder / name, ignored)) return folder / name;
  return {};
}

// People's own manifests, by name; they come before the shipped ones.
std::vector<ModelManifest> knownModels(const std::vector<std::filesystem::path>& folders) {
  std::vector<std::filesystem::path> found;
  for (const std::filesystem::path& folder : folders) {
    std::error_code error;
    std::vector<std::filesystem::path> here;
    for (const auto& entry : std::filesystem::directory_iterator(folder, error))
      if (entry.path().extension() == ".json") here.push_back(entry.path());
    std::sort(here.begin(), here.end());
    found.insert(found.end(), here.begin(), here.end());
  }
  std::vector<ModelManifest> models;
  for (const std::filesystem::path& path : found) models.push_back(readModelManifest(path));
  models.insert(models.end(), shippedModels().begin(), shippedModels().end());
  return models;
}

}  // namespace

ModelFile findModel(ModelManifest::Task task, const std::string& wanted,
                    const std::vector<std::filesystem::path>& folders) {
  if (wanted.ends_with(".json")) {
    ModelManifest manifest = readModelManifest(wanted);
    if (manifest.task != task)
      fail(wanted, task == ModelManifest::Task::faces ? "describes no face detector" : "describes no landmark model");
    std::vector<std::filesystem::path> with_its_own = folders;
    with_its_own.insert(with_its_own.begin(), std::filesystem::path(wanted).parent_path());
    std::filesystem::path path = findFile(manifest.file, with_its_own);
    return {std::move(manifest), std::move(path)};
  }
  std::optional<ModelFile> first;
  std::string names;
  for (const ModelManifest& manifest : knownModels(folders)) {
    if (manifest.task != task) continue;
    names.append(names.empty() ? "" : ", ").append(manifest.name);
    if (!wanted.empty() && manifest.name != wanted) continue;
    ModelFile model{manifest, findFile(manifest.file, folders)};
    if (!model.path.empty() || !wanted.empty()) return model;
    if (!first) first = std::move(model);
  }
  if (first) return *first;
  throw InputError("there is no model called '" + wanted + "'; give " + names + ", or the path of a manifest (.json)");
}

std::string readModelBytes(const ModelFile& model, bool allow_unlisted) {
  const std::string where = model.path.string();
  std::error_code error;
  if (std::filesystem::is_directory(model.path, error)) fail(where, "is a folder, not a model; name a file");
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(where.c_str(), "rb"), &std::fclose);
  if (!file) throw std::system_error(errno, std::generic_category(), where);
  std::string bytes;
  std::array<char, 1U << 16U> piece;
  for (std::size_t got = 0; (got = std::fread(piece.data(), 1, piece.size(), file.get())) > 0;) {
    bytes.append(piece.data(), got);
    if (bytes.size() > kMaxModelBytes) fail(where, "is larger than 256 MiB; no model of a face is");
  }
  if (std::ferror(file.get()) != 0) throw std::system_error(EIO, std::generic_category(), where);
  if (bytes.empty()) fail(where, "is empty; get it again: " + model.manifest.get);
  const std::string hash = sha256Hex(bytes);
  if (hash == model.manifest.sha256 || allow_unlisted) return bytes;
  if (model.manifest.sha256.empty()) {
    fail(where, "its manifest names no SHA-256; if you trust the file put " + hash +
                    " into a manifest of your own, or give --allow-unlisted-model");
  }
  fail(where, "is not the file that " + model.manifest.name + " names (SHA-256 " + hash.substr(0, 16) + "..., not " +
                  model.manifest.sha256.substr(0, 16) + "...): cut off or another version; get it again from " +
                  model.manifest.get + ", or give --allow-unlisted-model");
}

}  // namespace volto::capture
