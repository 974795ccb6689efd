#include "tools/cli/file_description.h"

#include <algorithm>
#include <cstdio>
#include <string_view>

#include <nlohmann/json.hpp>

#include "capture/csv_kind.h"
#include "rig/mesh.h"
#include "rig/mesh_io.h"
#include "tools/cli/exit_status.h"
#include "tools/cli/read_input.h"
#include "tools/pipeline/performance.h"

namespace volto::cli {

namespace {

constexpr std::size_t kDetectionBytes = 64 * 1024;

// A value on a line of its own, in words: numbers shortly, lists and objects by their length or, when short, whole.
std::string inWords(const Json& value) {
  constexpr std::size_t kShort = 8;
  if (value.is_string()) return value.get<std::string>();
  if (value.is_boolean()) return value.get<bool>() ? "yes" : "no";
  if (value.is_null()) return "-";
  if (value.is_number_float()) {
    char text[32];
    std::snprintf(text, sizeof text, "%.6g", value.get<double>());
    return text;
  }
  if (value.is_array() || value.is_object()) {
    if (value.empty()) return "none";
    if (value.size() > kShort) return std::to_string(value.size());
    std::string text;
    for (const auto& item : value.items()) {
      if (!text.empty()) text += ", ";
      if (value.is_object()) text += item.key() + " ";
      text += item.value().is_object() && item.value().contains("name") ? inWords(item.value()["name"])
                                                                        : inWords(item.value());
    }
    return text;
  }
  return value.dump();
}

}  // namespace

Json describeFile(const std::filesystem::path& path) {
  const std::string beginning = readBeginning(path, kDetectionBytes);
  if (beginning.empty()) throw CommandError(kBadData, path.string() + ": the file is empty");
  if (beginning.starts_with("SQLite format 3")) return describeTake(path);
  if (capture::csvKind(beginning) != capture::CsvKind::unknown || hasExtension(path, ".csv"))
    return describePerformance(path);
  if (rig::isMeshFileName(path)) return describeMesh(path);
  if (hasExtension(path, ".rig") || beginning.find('\0') != std::string::npos) return describeRig(path);
  throw CommandError(kBadData, path.string() + ": is no rig, take, mesh (OBJ, PLY, OFF, STL, glTF, GLB), OpenFace CSV or Live Link Face CSV file");
}

Json describeMesh(const std::filesystem::path& path) {
  const rig::Mesh mesh = rig::readMesh(path);
  Json out{{"kind", "mesh"}, {"file", path.filename().string()}};
  out["vertices"] = mesh.vertexCount();
  out["polygons"] = mesh.polygonCount();
  out["triangles"] = rig::triangulate(mesh).size();
  std::uint32_t components = 0;
  for (const std::uint32_t component : rig::connectedComponents(mesh)) components = std::max(components, component + 1);
  out["components"] = components;
  const auto corner = [](const auto& p) { return Json{p[0], p[1], p[2]}; };
  const Eigen::RowVector3d low = mesh.positions.colwise().minCoeff(), high = mesh.positions.colwise().maxCoeff();
  out["bounds"] = {{"low", corner(low)}, {"high", corner(high)}};
  Json materials = Json::array();
  for (const rig::Mesh::Material& material : mesh.materials) materials.push_back(material.name);
  out["materials"] = std::move(materials);
  out["texture_coordinates"] = !mesh.corner_texcoords.empty();

  out["vertex_colours"] = !mesh.vertex_colours.empty();

  const rig::MeshHealth health = rig::inspectMesh(mesh);
  Json problems = Json::array();
  const auto count = [&](std::size_t number, const char* what) {
    if (number > 0) problems.push_back(std::to_string(number) + what);
  };
  count(health.unused_vertices, " vertices are in no polygon");
  count(health.degenerate_polygons, " polygons name a vertex twice");
  count(health.duplicate_polygons, " polygons are there more than once");
  for (const std::string& note : mesh.notes) problems.push_back(note);
  out["problems"] = std::move(problems);
  return out;
}

Json describePerformance(const std::filesystem::path& path) {
  const pipeline::Performance performance = pipeline::readPerformance(path);
  Json out{{"kind", pipeline::formatName(performance.format)}, {"file", path.filename().string()}};
  out["frames"] = performance.frameCount();
  out["duration_s"] = performance.durationS();
  out["frames_per_second"] = performance.rate();
  out["gaps"] = performance.gaps();
  out["lost"] = performance.lost;
  std::size_t faces = 0;
  bool has_3d = false;
  for (const LandmarkFrame& frame : performance.landmarks) {
    faces += frame.face_present ? 1 : 0;
    has_3d = has_3d || !frame.points_camera_mm.empty();
  }
  ArkitObserved observed;
  for (const MaskFrame& frame : performance.masks) {
    faces += frame.state == TrackingState::tracking ? 1 : 0;
    observed |= frame.arkit_observed;
  }
  out["frames_with_face"] = faces;
  if (performance.landmarks.empty()) {
    Json missing = Json::array();
    for (std::size_t i = 0; i < kArkitBlendshapeCount; ++i) {
      if (!observed[i]) missing.push_back(kArkitBlendshapeNames[i]);
    }
    out["shapes"] = observed.count();
    out["shapes_missing"] = std::move(missing);
  } else {
    out["points"] = landmarkCount(performance.landmarks[0].layout);
    out["has_3d"] = has_3d;
  }
  out["problems"] = performance.warnings;
  return out;
}

std::string describeInWords(const Json& description) {
  std::string text;
  for (const auto& [key, value] : description.items()) {
    if (key == "problems") continue;
    std::string label = key;
    std::replace(label.begin(), label.end(), '_', ' ');
    text += label + ": " + inWords(value) + "\n";
  }
  for (const Json& problem : description.value("problems", Json::array()))
    text += "problem: " + problem.get<std::string>() + "\n";
  return text;
}

}  // namespace volto::cli
