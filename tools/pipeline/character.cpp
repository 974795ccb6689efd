#include "tools/pipeline/character.h"

#include <Eigen/Geometry>

#include "protocol/topics.h"
#include "rig/control_mask.h"

namespace volto::pipeline {

namespace {

std::array<float, 3> toFloat(const std::array<double, 3>& p) {
  return {static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2])};
}

// The reference mask is a human face in millimetres: its eye separation against the character's gives the unit.
double unitsPerMm(const rig::Rig& rig) {
  const double reference_mm = rig::measureFapu(rig::referenceMask()).fapu.eye_separation;
  return rig.fapu.fapu.eye_separation / reference_mm;
}

void addMesh(const rig::Mesh& mesh, protocol::Character& out) {
  out.neutral.resize(mesh.vertexCount());
  for (std::size_t v = 0; v < out.neutral.size(); ++v) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      out.neutral[v][axis] =
          static_cast<float>(mesh.positions(static_cast<Eigen::Index>(v), static_cast<Eigen::Index>(axis)));
    }
  }
  out.triangles = rig::triangulate(mesh);
  out.corner_vertices = mesh.corner_vertices;
  out.polygon_start = mesh.polygon_start;
  for (const rig::Mesh::Material& material : mesh.materials) out.materials.push_back({material.name, material.colour});

  // Fan triangulation, polygon by polygon: triangle k of a polygon is its corners 0, k + 1, k + 2.
  const bool texcoords = mesh.corner_texcoords.size() == mesh.corner_vertices.size();
  const bool materials = mesh.polygon_material.size() == mesh.polygonCount() && !mesh.materials.empty();
  for (std::size_t polygon = 0; polygon < mesh.polygonCount(); ++polygon) {
    const std::uint32_t first = mesh.polygon_start[polygon];
    for (std::uint32_t corner = first + 2; corner < mesh.polygon_start[polygon + 1]; ++corner) {
      if (materials) out.triangle_material.push_back(static_cast<std::uint16_t>(mesh.polygon_material[polygon]));
      if (texcoords) {
        for (const std::uint32_t c : {first, corner - 1, corner})
          out.corner_texcoords.push_back(mesh.corner_texcoords[c]);
      }
    }
  }
}

}  // namespace

protocol::Character characterOf(const rig::Rig& rig, bool with_mesh) {
  protocol::Character out;
  out.name = protocol::topicNameFrom(rig.name);
  for (const rig::Blendshape& shape : rig.blendshapes) out.blendshape_names.push_back(shape.name);
  if (with_mesh) addMesh(rig.neutral, out);
  bool left = false, right = false;
  for (const rig::RigidPart& part : rig.rigid_parts) {
    if (part.follows == rig::RigidPart::Follows::left_eye) {
      out.left_eye_centre = toFloat(part.centre);
      left = true;
    } else if (part.follows == rig::RigidPart::Follows::right_eye) {
      out.right_eye_centre = toFloat(part.centre);
      right = true;
    }
  }
  const Eigen::Quaterniond rotation(rig.mesh_from_head);
  out.mesh_from_head = {static_cast<float>(rotation.x()), static_cast<float>(rotation.y()),
                        static_cast<float>(rotation.z()), static_cast<float>(rotation.w())};
  out.units_per_mm = unitsPerMm(rig);
  out.has_mesh = with_mesh;
  out.has_gaze = left && right;
  return out;
}

}  // namespace volto::pipeline
