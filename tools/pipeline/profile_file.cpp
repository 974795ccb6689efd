#include "tools/pipeline/profile_file.h"

#include <cerrno>
#include <cmath>
#include <fstream>
#include <system_error>

#include <nlohmann/json.hpp>

#include "capture/errors.h"
#include "rig/feature_points.h"

namespace volto::pipeline {

namespace {

using Json = nlohmann::json;

constexpr std::size_t kMaxBytes = 1U << 20U;
constexpr int kVersion = 1;
constexpr double kLargest_mm = 1e4;

double numberIn(const Json& value, double low, double high) {
  const double number = value.is_number() ? value.get<double>() : std::nan("");
  if (!(number >= low && number <= high)) throw std::invalid_argument("a number is missing or out of range");
  return number;
}

}  // namespace

std::string profileText(const tracker::NeutralFace& face) {
  Json points = Json::object();
  const auto ids = rig::featurePoints();
  for (std::size_t i = 0; i < kFeaturePointCount; ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    points[std::string(ids[i].id)] = {face.positions_mm(row, 0), face.positions_mm(row, 1), face.positions_mm(row, 2),
                                      face.confidence[i]};
  }
  Json shapes = Json::object();
  for (std::size_t k = 0; k < kArkitBlendshapeCount; ++k)
    shapes[std::string(kArkitBlendshapeNames[k])] = {face.usual[k], face.deviation[k]};
  Json lids = Json::array();
  for (const tracker::LidRange& lid : face.lids) lids.push_back({lid.open, lid.closed});
  const Json root = {{"volto_profile", kVersion}, {"neutral_mm", points}, {"habits", shapes}, {"lids", lids}};
  return root.dump(1) + "\n";
}

tracker::NeutralFace readProfile(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw std::system_error(errno, std::generic_category(), path.string());
  std::string text(kMaxBytes + 1, '\0');
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(file.gcount()));
  try {
    if (text.size() > kMaxBytes) throw std::invalid_argument("it is larger than 1 MiB");
    const Json root = Json::parse(text);
    if (!root.is_object() || root.value("volto_profile", 0) != kVersion)
      throw std::invalid_argument("\"volto_profile\" is not " + std::to_string(kVersion));
    tracker::NeutralFace face;
    const auto ids = rig::featurePoints();
    for (std::size_t i = 0; i < kFeaturePointCount; ++i) {
      const Json& point = root.at("neutral_mm").at(std::string(ids[i].id));
      if (!point.is_array() || point.size() != 4) throw std::invalid_argument("a point has no four numbers");
      for (std::size_t c = 0; c < 3; ++c)
        face.positions_mm(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(c)) =
            numberIn(point[c], -kLargest_mm, kLargest_mm);
      face.confidence[i] = static_cast<float>(numberIn(point[3], 0, 1));
    }
    for (std::size_t k = 0; k < kArkitBlendshapeCount; ++k) {
      const Json& shape = root.at("habits").at(std::string(kArkitBlendshapeNames[k]));
      if (!shape.is_array() || shape.size() != 2) throw std::invalid_argument("a shape has no two numbers");
      face.usual[k] = static_cast<float>(numberIn(shape[0], 0, 1));
      face.deviation[k] = static_cast<float>(numberIn(shape[1], 0, 1));
    }
    const Json& lids = root.at("lids");
    if (!lids.is_array() || lids.size() != face.lids.size()) throw std::invalid_argument("\"lids\" is not two ranges");
    for (std::size_t eye = 0; eye < face.lids.size(); ++eye) {
      if (!lids[eye].is_array() || lids[eye].size() != 2) throw std::invalid_argument("a lid has no two numbers");
      face.lids[eye].open = static_cast<float>(numberIn(lids[eye][0], 0, 10));
      face.lids[eye].closed = static_cast<float>(numberIn(lids[eye][1], 0, 10));
    }
    return face;
  } catch (const std::exception& error) {
    throw capture::InputError(path.string() + ": is no profile that Volto wrote (" + error.what() +
                              "); remove it, and it will be made anew");
  }
}

}  // namespace volto::pipeline
