#include "tools/export/character_parts.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

#include "tools/picture/rig_look.h"

namespace volto::exporter {
namespace {

using picture::Look;
using picture::Surface;
using picture::Vec3;

ExportMaterial materialOf(const Surface& surface) {
  ExportMaterial out;
  out.name = surface.name;
  out.colour = {surface.albedo.x, surface.albedo.y, surface.albedo.z};
  for (float& part : out.colour) part = std::clamp(part, 0.0F, 1.0F);
  if (!surface.drawn) out.opacity = 0.02F;  // a film over the eye
  // Blinn-Phong's exponent to GGX's roughness, as most converters do it: alpha = sqrt(2 / (n + 2)) = roughness^2.
  out.roughness = std::clamp(std::pow(2.0F / (surface.gloss + 2.0F), 0.25F), 0.05F, 1.0F);
  const auto has = [&](const char* word) { return surface.name.find(word) != std::string::npos; };
  out.double_sided = has("lash") || has("brow") || has("hair");
  return out;
}

class Cutter {
 public:
  explicit Cutter(const rig::Rig& rig) : rig_(rig), mesh_(rig.neutral), look_(picture::lookOfRig(rig)) {
    for (const Surface& surface : look_.surfaces) out_.materials.push_back(materialOf(surface));
    makeParts();
    for (std::size_t p = 0; p < mesh_.polygonCount(); ++p) addPolygon(p);
    std::erase_if(out_.parts, [](const ExportPart& part) { return part.groups.empty(); });
    tidyMaterials();
  }
  CharacterParts take() { return std::move(out_); }

 private:
  void makeParts() {
    part_of_.assign(mesh_.vertexCount(), 0);
    out_.parts.push_back({});
    out_.parts[0].name = "face";
    for (const auto& [follows, name] : {std::pair{rig::RigidPart::Follows::left_eye, "leftEye"},
                                        std::pair{rig::RigidPart::Follows::right_eye, "rightEye"}}) {
      const auto number = static_cast<std::uint8_t>(out_.parts.size());
      bool any = false;
      ExportPart part;
      part.name = name;
      part.eye = true;
      for (const rig::RigidPart& rigid : rig_.rigid_parts) {
        if (rigid.follows != follows) continue;
        if (!any) part.origin = rigid.centre;
        any = true;
        for (const std::uint32_t v : rigid.vertices)
          if (v < part_of_.size()) part_of_[v] = number;
      }
      if (any) out_.parts.push_back(std::move(part));
    }
    keepJoinedEyes();
    copies_.resize(mesh_.vertexCount(), 0);
    for (std::uint32_t v = 0; v < mesh_.vertexCount(); ++v) {
      ExportPart& part = out_.parts[part_of_[v]];
      first_.push_back(static_cast<std::uint32_t>(part.vertex.size()));
      addVertex(part, v, {0.0F, 0.0F});
    }
  }

  // An eye that some polygon joins to the rest cannot turn by itself: it stays in the face.
  void keepJoinedEyes() {
    std::array<bool, 3> joined{};
    for (std::size_t p = 0; p < mesh_.polygonCount(); ++p) {
      const std::uint32_t begin = mesh_.polygon_start[p], end = mesh_.polygon_start[p + 1];
      for (std::uint32_t c = begin + 1; c < end; ++c) {
        const std::uint8_t a = part_of_[mesh_.corner_vertices[begin]], b = part_of_[mesh_.corner_vertices[c]];
        if (a != b) joined[a] = joined[b] = true;
      }
    }
    for (std::uint8_t& part : part_of_)
      if (joined[part]) part = 0;
  }

  void addVertex(ExportPart& part, std::uint32_t v, std::array<float, 2> uv) {
    part.vertex.push_back(v);
    if (!mesh_.corner_texcoords.empty()) part.texcoords.push_back(uv);
    if (look_.vertex_tint.empty()) return;
    const Vec3 tint = look_.vertex_tint[v];
    part.colours.push_back(
        {std::clamp(tint.x, 0.0F, 1.0F), std::clamp(tint.y, 0.0F, 1.0F), std::clamp(tint.z, 0.0F, 1.0F)});
  }

  std::uint32_t corner(ExportPart& part, std::size_t c) {
    const std::uint32_t v = mesh_.corner_vertices[c];
    if (mesh_.corner_texcoords.empty()) return first_[v];
    const std::array<float, 2> uv = mesh_.corner_texcoords[c];
    const auto [entry, fresh] = with_uv_.try_emplace({v, uv[0], uv[1]}, first_[v]);
    if (!fresh) return entry->second;
    if (copies_[v]++ == 0) {
      part.texcoords[first_[v]] = uv;  // the first one met takes the vertex's own place
      return entry->second;
    }
    entry->second = static_cast<std::uint32_t>(part.vertex.size());
    addVertex(part, v, uv);
    return entry->second;
  }

  void addPolygon(std::size_t p) {
    const std::uint32_t begin = mesh_.polygon_start[p], end = mesh_.polygon_start[p + 1];
    const std::uint8_t number = part_of_[mesh_.corner_vertices[begin]];
    ExportPart& part = out_.parts[number];
    const std::uint32_t material = materialOfPolygon(p);
    auto group = std::find_if(part.groups.begin(), part.groups.end(),
                              [&](const ExportPart::Group& g) { return g.material == material; });
    if (group == part.groups.end()) group = part.groups.insert(part.groups.end(), {material, {}});
    const std::uint32_t first = corner(part, begin);
    for (std::uint32_t c = begin + 2; c < end; ++c) {
      const std::uint32_t before = corner(part, c - 1), here = corner(part, c);
      group->corners.insert(group->corners.end(), {first, before, here});
    }
  }

  // The surface's own, or on a painted eyeball the part of the eye that the polygon lies in.
  std::uint32_t materialOfPolygon(std::size_t p) {
    const std::uint32_t surface = look_.polygon_surface[p];
    const int ball = look_.surfaces[surface].eyeball;
    if (ball < 0) return surface;
    const picture::Eyeball& eye = look_.eyeballs[static_cast<std::size_t>(ball)];
    Vec3 middle{};
    for (std::uint32_t c = mesh_.polygon_start[p]; c < mesh_.polygon_start[p + 1]; ++c) {
      const auto row = mesh_.positions.row(mesh_.corner_vertices[c]);
      middle = middle +
               normalised(Vec3{static_cast<float>(row.x()), static_cast<float>(row.y()), static_cast<float>(row.z())} -
                          eye.centre);
    }
    const float angle = std::acos(std::clamp(dot(normalised(middle), eye.axis), -1.0F, 1.0F));
    if (angle > eye.iris_rad) return surface;
    const bool pupil = angle < eye.pupil_rad;
    const auto [entry, fresh] = painted_.try_emplace({ball, pupil}, static_cast<std::uint32_t>(out_.materials.size()));
    if (fresh) {
      Surface painted = picture::surfaceByName(pupil ? "pupil" : "iris");
      if (!pupil) painted.albedo = eye.iris;
      out_.materials.push_back(materialOf(painted));
    }
    return entry->second;
  }

  // Some surfaces of a look are there only in case, and some are the same: each part of a face may bring its own.
  void tidyMaterials() {
    std::vector<bool> used(out_.materials.size(), false);
    for (const ExportPart& part : out_.parts)
      for (const ExportPart::Group& group : part.groups) used[group.material] = true;
    std::vector<std::uint32_t> number(out_.materials.size(), 0);
    std::vector<ExportMaterial> kept;
    for (std::size_t m = 0; m < used.size(); ++m) {
      if (!used[m]) continue;
      const auto same = std::find(kept.begin(), kept.end(), out_.materials[m]);
      number[m] = static_cast<std::uint32_t>(same - kept.begin());
      if (same == kept.end()) kept.push_back(out_.materials[m]);
    }
    out_.materials = std::move(kept);
    for (ExportPart& part : out_.parts) {
      std::vector<ExportPart::Group> groups;
      for (ExportPart::Group& group : part.groups) {
        group.material = number[group.material];
        const auto same = std::find_if(groups.begin(), groups.end(),
                                       [&](const ExportPart::Group& g) { return g.material == group.material; });
        if (same == groups.end())
          groups.push_back(std::move(group));
        else
          same->corners.insert(same->corners.end(), group.corners.begin(), group.corners.end());
      }
      part.groups = std::move(groups);
    }
  }

  const rig::Rig& rig_;
  const rig::Mesh& mesh_;
  Look look_;
  CharacterParts out_;
  std::vector<std::uint8_t> part_of_;  // of vertices
  std::vector<std::uint32_t> first_;   // of vertices: where in its part
  std::vector<std::uint32_t> copies_;  // of vertices: texture coordinates met so far
  std::map<std::tuple<std::uint32_t, float, float>, std::uint32_t> with_uv_;
  std::map<std::pair<int, bool>, std::uint32_t> painted_;
};

}  // namespace

CharacterParts takeApart(const rig::Rig& rig) { return Cutter(rig).take(); }

}  // namespace volto::exporter
