#include <algorithm>
#include <array>

#include <nlohmann/json.hpp>

#include "rig/rig_file.h"
#include "tools/cli/describe_health.h"
#include "tools/cli/file_description.h"

namespace volto::cli {

namespace {

const char* followsName(rig::RigidPart::Follows follows) {
  switch (follows) {
    case rig::RigidPart::Follows::head:
      return "head";
    case rig::RigidPart::Follows::jaw:
      return "jaw";
    case rig::RigidPart::Follows::left_eye:
      return "left_eye";
    case rig::RigidPart::Follows::right_eye:
      return "right_eye";
    case rig::RigidPart::Follows::skin:
      return "skin";
  }
  return "unknown";
}

Json featurePointsOf(const rig::Rig& rig) {
  Json points = Json::object();
  for (std::size_t i = 0; i < kFeaturePointCount; ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    const std::int32_t vertex = rig.feature_vertex[i];
    points[std::string(rig::featurePoints()[i].id)] = {
        {"vertex", vertex < 0 ? Json(nullptr) : Json(vertex)},
        {"position", {rig.feature_positions(row, 0), rig.feature_positions(row, 1), rig.feature_positions(row, 2)}}};
  }
  return points;
}

Json operatorOf(const rig::DeformationOperator& op) {
  std::size_t moving = 0, most = 0;
  for (std::size_t v = 0; v < op.vertexCount(); ++v) {
    const std::size_t in_row = op.row_start[v + 1] - op.row_start[v];
    moving += in_row > 0 ? 1 : 0;
    most = std::max(most, in_row);
  }
  const double mean = moving > 0 ? static_cast<double>(op.weight.size()) / static_cast<double>(moving) : 0.0;
  return {{"rows", op.vertexCount()},
          {"moving_rows", moving},
          {"nonzeros", op.weight.size()},
          {"nonzeros_per_moving_row", mean},
          {"most_in_a_row", most}};
}

}  // namespace

Json describeRig(const std::filesystem::path& path) {
  const rig::Rig rig = rig::readRig(path);
  Json out{{"kind", "rig"}, {"file", path.filename().string()}};
  out["name"] = rig.name;
  out["mesh_file"] = rig.mesh_file;
  out["vertices"] = rig.neutral.vertexCount();
  out["polygons"] = rig.neutral.polygonCount();
  const rig::Fapu& fapu = rig.fapu.fapu;
  out["fapu"] = {{"IRISD0", fapu.iris_diameter},
                 {"ES0", fapu.eye_separation},
                 {"ENS0", fapu.eye_nose},
                 {"MNS0", fapu.mouth_nose},
                 {"MW0", fapu.mouth_width}};
  out["fapu_substitutions"] = rig.fapu.substitutions;

  std::array<std::size_t, 4> kinds{};
  for (const rig::AssociationKind kind : rig.association.kind) ++kinds[static_cast<std::size_t>(kind)];
  out["association"] = {{"ray", kinds[0]}, {"geodesic", kinds[1]}, {"rigid_part", kinds[2]}, {"outside", kinds[3]}};
  out["operator"] = operatorOf(rig.deformation);

  Json shapes = Json::array(), unseen = Json::array();
  for (const rig::Blendshape& shape : rig.blendshapes) {
    shapes.push_back({{"name", shape.name}, {"moves_mask", shape.moves_mask}});
    if (!shape.moves_mask) unseen.push_back(shape.name);
  }
  out["blendshapes"] = std::move(shapes);
  out["blendshapes_not_observable"] = std::move(unseen);
  Json parts = Json::array();
  for (const rig::RigidPart& part : rig.rigid_parts) {
    parts.push_back({{"name", part.name},
                     {"follows", followsName(part.follows)},
                     {"vertices", part.vertices.size()},
                     {"centre", part.centre}});
  }
  out["rigid_parts"] = std::move(parts);
  out["feature_points"] = featurePointsOf(rig);
  if (!rig.refined.empty())
    out["refined_mask"] = {{"points", rig.refined.pointCount()},
                           {"triangles", rig.refined.triangles.size()},
                           {"nonzeros", rig.refined.to_vertices.weight.size()}};
  Json problems = Json::array();
  out["health"] = describeHealth(rig, problems);
  out["problems"] = std::move(problems);
  return out;
}

}  // namespace volto::cli
