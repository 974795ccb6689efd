#include "transfer/part_transfer.h"

#include <algorithm>
#include <map>
#include <string>

#include <Eigen/Geometry>

#include "rig/closest_point.h"
#include "rig/rigid_motion.h"
#include "transfer/surface.h"

namespace volto::transfer {
namespace {

constexpr double kHoldsTeethEs = 0.03;
constexpr double kHoldsLeast = 0.5;  // of the motion: what goes by less holds the upper teeth, if any

// Two axes in the triangle, one off it; orthonormal, so that lashes do not stretch with the lid.
Eigen::Matrix3d frameOf(const rig::VertexPositions& p, const std::array<std::uint32_t, 3>& t) {
  const Eigen::Vector3d a = p.row(t[0]), b = p.row(t[1]), c = p.row(t[2]);
  Eigen::Matrix3d frame = Eigen::Matrix3d::Identity();
  const Eigen::Vector3d along = b - a, normal = along.cross(c - a);
  if (!(along.norm() > 0) || !(normal.norm() > 0)) return frame;
  frame.col(0) = along.normalized();
  frame.col(2) = normal.normalized();
  frame.col(1) = frame.col(2).cross(frame.col(0));
  return frame;
}

}  // namespace

PartTransfer::PartTransfer(const rig::Rig& source, const rig::Rig& target) : source_(source), target_(target) {
  using Follows = rig::RigidPart::Follows;
  for (const Follows follows : {Follows::jaw, Follows::left_eye, Follows::right_eye}) {
    Turning t;
    for (const auto& [rig, out] : {std::pair{&source, &t.source}, std::pair{&target, &t.target}})
      for (const rig::RigidPart& part : rig->rigid_parts)
        if (part.follows == follows) out->insert(out->end(), part.vertices.begin(), part.vertices.end());
    // Artists often open the jaw and leave the tongue behind: the jaw is where its teeth are.
    t.middle = t.target;
    const auto teethOf = [&](const rig::Rig& rig) {
      std::vector<std::uint32_t> out;
      for (const rig::RigidPart& part : rig.rigid_parts)
        if (part.follows == Follows::jaw && part.name.find("teeth") != std::string::npos)
          out.insert(out.end(), part.vertices.begin(), part.vertices.end());
      return out;
    };
    if (follows == Follows::jaw) {
      std::vector<std::uint32_t> on_source = teethOf(source), on_target = teethOf(target);
      if (on_source.size() >= 3 && !on_target.empty()) {
        t.source = std::move(on_source);
        t.middle = std::move(on_target);
      }
    }
    t.share.assign(t.target.size(), 1.0);
    // Gums of both jaws in one piece go along by what is near the lower teeth (rig/rigid_parts.h): those of the upper jaw
    // stay, what holds the lower teeth goes as they do.
    std::vector<double> share(target.neutral.vertexCount(), 0.0);
    bool known = false;
    for (const rig::PartMotion& motion : target.part_motions) {
      if (motion.follows != follows) continue;
      known = true;
      for (std::size_t i = 0; i < motion.vertices.size(); ++i)
        share[motion.vertices[i]] = static_cast<double>(motion.share[i]);
    }
    if (known) {
      const double near = kHoldsTeethEs * target.fapu.fapu.eye_separation;
      std::vector<double> holding;
      for (const std::uint32_t v : t.target) {
        if (share[v] >= 1 || share[v] < kHoldsLeast) continue;
        const Eigen::RowVector3d here = target.neutral.positions.row(v);
        const bool holds = std::any_of(t.middle.begin(), t.middle.end(), [&](std::uint32_t tooth) {
          return share[tooth] == 1 && (target.neutral.positions.row(tooth) - here).squaredNorm() < near * near;
        });
        if (holds) holding.push_back(share[v]);
      }
      // Nearly all of it, so that no edge of the gums stays behind above the teeth.
      double full = 1;
      if (!holding.empty()) {
        const auto few = holding.begin() + static_cast<std::ptrdiff_t>(holding.size() / 20);
        std::nth_element(holding.begin(), few, holding.end());
        full = *few;
      }
      for (std::size_t i = 0; i < t.target.size(); ++i) t.share[i] = std::min(1.0, share[t.target[i]] / full);
    }
    if (t.source.size() >= 3 && !t.target.empty()) turning_.push_back(std::move(t));
  }
  const rig::ClosestPoint nearest(target.neutral.positions, skinTriangles(target).triangles);
  if (nearest.empty()) return;
  // Lashes grow on the margin of their eye: where the contacts tie them to an eyeball.
  std::vector<std::int32_t> ball_of(target.neutral.vertexCount(), -1);
  for (const rig::Rider& rider : target.contacts.riders) ball_of[rider.vertex] = rider.ball;
  std::vector<std::int32_t> ring_of_ball(target.contacts.balls.size(), -1);
  for (const rig::SlitContact& slit : target.contacts.slits) {
    if (slit.ball < 0) continue;
    ring_of_ball[static_cast<std::size_t>(slit.ball)] = static_cast<std::int32_t>(rings_.size());
    rings_.emplace_back(target, slit);
  }
  const std::vector<std::uint32_t> piece = rig::connectedComponents(target.neutral);
  for (const rig::RigidPart& p : target.rigid_parts) {
    if (p.follows != Follows::skin) continue;
    // Piece by piece: lashes of both lids and the tear film are often one part.
    std::vector<std::map<std::uint32_t, std::vector<std::uint32_t>>> on_ring(rings_.size());
    for (const std::uint32_t v : p.vertices) {
      if (const std::int32_t ball = ball_of[v]; ball >= 0 && ring_of_ball[static_cast<std::size_t>(ball)] >= 0) {
        on_ring[static_cast<std::size_t>(ring_of_ball[static_cast<std::size_t>(ball)])][piece[v]].push_back(v);
        continue;
      }
      const Eigen::Vector3d here = target.neutral.positions.row(v);
      const rig::SurfacePoint on = nearest.find(here);
      if (on.triangle < 0) continue;
      Rider rider{v, {nearest.triangle(on.triangle), on.barycentric}, {}};
      rider.offset = frameOf(target.neutral.positions, rider.on.vertex).transpose() *
                     (here - at(target.neutral.positions, rider.on));
      riders_.push_back(rider);
    }
    for (std::size_t r = 0; r < rings_.size(); ++r)
      for (const auto& [of, vertices] : on_ring[r]) rings_[r].add(vertices);
  }
}

void PartTransfer::apply(const rig::VertexPositions& example, rig::VertexPositions& result) const {
  const Eigen::Matrix3d turn = target_.mesh_from_head * source_.mesh_from_head.transpose();
  const double size = target_.fapu.fapu.eye_separation / source_.fapu.fapu.eye_separation;
  for (const Turning& t : turning_) {
    const rig::RigidMotion on_source = rig::bestRigidMotion(t.source, source_.neutral.positions, example);
    const Eigen::Matrix3d rotation = turn * on_source.rotation * turn.transpose();
    const Eigen::Vector3d shift = size * (turn * on_source.shift);
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    for (const std::uint32_t v : t.middle)
      centre += target_.neutral.positions.row(v).transpose() / static_cast<double>(t.middle.size());
    for (std::size_t i = 0; i < t.target.size(); ++i) {
      const Eigen::Vector3d rest = target_.neutral.positions.row(t.target[i]);
      const Eigen::Vector3d moved = rotation * (rest - centre) + centre + shift;
      result.row(t.target[i]) = (rest + t.share[i] * (moved - rest)).transpose();
    }
  }
  for (const LidRing& ring : rings_) ring.apply(result);
  for (const Rider& r : riders_)
    result.row(r.vertex) = (at(result, r.on) + frameOf(result, r.on.vertex) * r.offset).transpose();
}

}  // namespace volto::transfer
