#include "rig/part_motion.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string_view>

#include <Eigen/Geometry>

namespace volto::rig {
namespace {

constexpr double kSideways_rad = 0.60, kUp_rad = 0.41, kDown_rad = 0.65;

std::array<float, 3> toFloat(const Eigen::Vector3d& p) {
  return {static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2])};
}

class Motions {
 public:
  explicit Motions(const Rig& rig) : rig_(rig), es_(rig.fapu.fapu.eye_separation) {}

  std::vector<PartMotion> make() const {
    std::vector<PartMotion> out;
    if (auto m = jaw()) out.push_back(std::move(*m));
    if (auto m = eye(RigidPart::Follows::left_eye, "Left")) out.push_back(std::move(*m));
    if (auto m = eye(RigidPart::Follows::right_eye, "Right")) out.push_back(std::move(*m));
    return out;
  }

 private:
  Eigen::Vector3d point(std::string_view id) const {  // head frame
    return rig_.mesh_from_head.transpose() *
           rig_.feature_positions.row(static_cast<Eigen::Index>(featurePointIndex(id).value())).transpose();
  }
  Eigen::Vector3d moved(const Blendshape& shape, std::string_view id) const {  // head frame
    const auto& d = shape.mask_displacement[featurePointIndex(id).value()];
    return rig_.mesh_from_head.transpose() *
           Eigen::Vector3d(static_cast<double>(d[0]), static_cast<double>(d[1]), static_cast<double>(d[2]));
  }
  // The boss of the chin: skin that lies close on the bone, not far from the teeth.
  Eigen::Vector3d chinMotion(const Blendshape& shape) const { return moved(shape, "2.10"); }
  const Blendshape* shapeNamed(std::string_view name) const {
    const auto found = std::find_if(rig_.blendshapes.begin(), rig_.blendshapes.end(),
                                    [&](const Blendshape& b) { return b.name == name; });
    return found == rig_.blendshapes.end() ? nullptr : &*found;
  }
  PartMotion::Turn turn(std::size_t shape, const Eigen::Vector3d& rotation, const Eigen::Vector3d& translation) const {
    return {static_cast<std::uint16_t>(shape), toFloat(rig_.mesh_from_head * rotation),
            toFloat(rig_.mesh_from_head * translation)};
  }

  std::optional<PartMotion> jaw() const {
    PartMotion out;
    out.follows = RigidPart::Follows::jaw;
    const Blendshape* open = shapeNamed("jawOpen");
    if (open == nullptr) return std::nullopt;

    // The chin goes at right angles to its arm, so the hinge is on one line; how far back, the ears say.
    const Eigen::Vector3d chin = point("2.10");
    const Eigen::Vector3d d = chinMotion(*open), ear = (point("10.7") + point("10.8")) / 2;
    const Eigen::Vector3d halfway = chin + d / 2;
    Eigen::Vector3d hinge = ear + Eigen::Vector3d(0, -0.32, -0.33) * es_;
    hinge[0] = chin[0];
    hinge[2] = std::min(hinge[2], chin[2] - 0.7 * es_);
    // On that line where it crosses the depth of the ears, unless that is nowhere near them.
    if (-d[1] > 0.05 * es_)
      hinge[1] = std::clamp(halfway[1] - (hinge[2] - halfway[2]) * d[2] / d[1], ear[1] - 0.5 * es_, ear[1] + 0.4 * es_);
    out.pivot = toFloat(rig_.mesh_from_head * hinge);

    constexpr double kSkinOfBone = 0.95;  // 0.89 on ICT; teeth must not come through a shorter chin
    for (std::size_t k = 0; k < rig_.blendshapes.size(); ++k) {
      const Blendshape& shape = rig_.blendshapes[k];
      const Eigen::Vector3d by = chinMotion(shape) / kSkinOfBone;
      if (shape.name == "jawOpen") {
        const Eigen::Vector3d arm = chin - hinge;
        const double length = std::hypot(arm[1], arm[2]);
        // Positive about +x: what is in front goes down.
        const double angle =
            2 * std::asin(std::clamp(0.5 * std::hypot(by[1], by[2]) / length, 0.0, 0.3));  // 35 degrees at most
        out.turns.push_back(turn(k, {angle, 0, 0}, {0, 0, 0}));
      } else if (shape.name == "jawForward") {
        out.turns.push_back(turn(k, {0, 0, 0}, {0, by[1], by[2]}));
      } else if (shape.name == "jawLeft" || shape.name == "jawRight") {
        // A turn of two degrees for a seventh of an eye separation, the rest a slide.
        const double yaw = 0.24 * by[0] / es_;
        out.turns.push_back(turn(k, {0, yaw, 0}, {0.87 * by[0] - yaw * (chin[2] - hinge[2]), 0.5 * by[1], 0}));
      }
    }
    addJawVertices(out);
    if (out.vertices.empty()) return std::nullopt;
    return out;
  }

  // All of the teeth and the tongue; of gums that hold both jaws in one piece the share that the rigging gave them,
  // read from the operator.
  void addJawVertices(PartMotion& out) const {
    std::vector<std::pair<std::uint32_t, float>> all;
    for (const RigidPart& part : rig_.rigid_parts) {
      if (part.follows != RigidPart::Follows::jaw) continue;
      std::vector<double> sum;
      for (const std::uint32_t v : part.vertices) {
        double s = 0;
        for (std::uint32_t e = rig_.deformation.row_start[v]; e < rig_.deformation.row_start[v + 1]; ++e)
          s += static_cast<double>(rig_.deformation.weight[e]);
        sum.push_back(s);
      }
      const double most = *std::max_element(sum.begin(), sum.end()), least = *std::min_element(sum.begin(), sum.end());
      const bool joined = least < 0.1 * most;
      for (std::size_t i = 0; i < part.vertices.size(); ++i) {
        const double share = joined && most > 0 ? std::clamp(1.25 * sum[i] / most, 0.0, 1.0) : 1.0;
        if (share > 0) all.emplace_back(part.vertices[i], static_cast<float>(share));
      }
    }
    std::sort(all.begin(), all.end());
    for (const auto& [v, share] : all) {
      if (!out.vertices.empty() && out.vertices.back() == v) continue;
      out.vertices.push_back(v);
      out.share.push_back(share);
    }
  }

  std::optional<PartMotion> eye(RigidPart::Follows follows, const std::string& side) const {
    PartMotion out;
    out.follows = follows;
    bool found = false;
    for (const RigidPart& part : rig_.rigid_parts) {
      if (part.follows != follows) continue;
      if (!found)
        for (std::size_t axis = 0; axis < 3; ++axis) out.pivot[axis] = static_cast<float>(part.centre[axis]);
      found = true;
      out.vertices.insert(out.vertices.end(), part.vertices.begin(), part.vertices.end());
    }
    if (!found) return std::nullopt;
    std::sort(out.vertices.begin(), out.vertices.end());
    out.vertices.erase(std::unique(out.vertices.begin(), out.vertices.end()), out.vertices.end());
    out.share.assign(out.vertices.size(), 1.0F);
    // Inward is to the subject's right for the left eye. About +y: to the subject's left; about +x: down.
    const double in = side == "Left" ? -1 : 1;
    for (std::size_t k = 0; k < rig_.blendshapes.size(); ++k) {
      const std::string& name = rig_.blendshapes[k].name;
      Eigen::Vector3d rotation = Eigen::Vector3d::Zero();
      if (name == "eyeLookIn" + side) rotation[1] = in * kSideways_rad;
      if (name == "eyeLookOut" + side) rotation[1] = -in * kSideways_rad;
      if (name == "eyeLookUp" + side) rotation[0] = -kUp_rad;
      if (name == "eyeLookDown" + side) rotation[0] = kDown_rad;
      if (rotation.squaredNorm() > 0) out.turns.push_back(turn(k, rotation, {0, 0, 0}));
    }
    if (out.turns.empty()) return std::nullopt;
    return out;
  }

  const Rig& rig_;
  double es_;
};

}  // namespace

std::vector<PartMotion> partMotions(const Rig& rig) { return Motions(rig).make(); }

}  // namespace volto::rig
