#include "rig/lining.h"

#include <algorithm>

#include <Eigen/Geometry>

#include "rig/closest_point.h"
#include "rig/feature_points.h"
#include "rig/parallel.h"

namespace volto::rig {
namespace {

constexpr double kThickestEs = 0.2;
// Lips roll over their margin: the inside goes with the front only farther in. From no share to all of it.
constexpr double kFreeEs = 0.2, kWithFrontEs = 0.4;

// Points at an opening of the skin: the margins of the lips and their corners, and the nostrils. What is nearest to them
// and has no ray lies inside of it. Not the lids: what is behind them lies on the ball and goes with it (rig/contacts.h).
constexpr std::string_view kAtOpening[] = {"2.2", "2.3", "2.4", "2.5", "2.6", "2.7",
                                           "2.8", "2.9", "9.1", "9.2", "9.4", "9.5"};

double smoothStep(double x) {
  x = std::clamp(x, 0.0, 1.0);
  return x * x * (3 - 2 * x);
}

}  // namespace

std::vector<SkinTie> findLining(const Mesh& mesh, const Skin& skin, const std::vector<bool>& is_skin,
                                  const SkinAssociation& association, double eye_separation) {
  std::array<bool, kFeaturePointCount> opening{};
  for (const std::string_view id : kAtOpening) opening[featurePointIndex(id).value()] = true;
  std::vector<bool> inside(mesh.vertexCount(), false);
  std::vector<std::uint32_t> lining;
  for (std::uint32_t v = 0; v < inside.size(); ++v) {
    if (!skin.stands(v) || association.on_mask[v] || association.kind[v] != AssociationKind::geodesic) continue;
    Eigen::Index nearest = 0;
    association.point_distance.row(v).minCoeff(&nearest);
    if (!opening[static_cast<std::size_t>(nearest)]) continue;
    inside[v] = true;
    lining.push_back(v);
  }
  std::vector<std::array<std::uint32_t, 3>> outer;
  for (const auto& t : skin.triangles)
    if (is_skin[skin.component[t[0]]] && !inside[t[0]] && !inside[t[1]] && !inside[t[2]]) outer.push_back(t);
  const ClosestPoint surface(mesh.positions, std::move(outer));
  if (surface.empty()) return {};

  std::vector<SkinTie> all(lining.size());
  parallelFor(lining.size(), [&](std::size_t i) {
    const std::uint32_t v = lining[i];
    const Eigen::Vector3d here = mesh.positions.row(v);
    const SurfacePoint front = surface.find(here, kThickestEs * eye_separation);
    if (front.triangle < 0) return;
    SkinTie tie{v, surface.triangle(front.triangle), front.barycentric, 0};
    Eigen::Vector3d place = Eigen::Vector3d::Zero(), normal = Eigen::Vector3d::Zero();
    for (std::size_t k = 0; k < 3; ++k) {
      place += tie.weight[k] * mesh.positions.row(tie.to[k]).transpose();
      normal += tie.weight[k] * skin.normals.row(tie.to[k]).transpose();
      if (opposite(association.side[tie.to[k]], association.side[v])) return;
    }
    const double behind = normal.normalized().dot(place - here);
    if (behind < 0.5 * front.distance || normal.dot(skin.normals.row(v)) > 0) return;
    const double inwards = association.point_distance.row(v).minCoeff() / eye_separation;
    tie.share = (1 - smoothStep(front.distance / (kThickestEs * eye_separation))) *
                smoothStep((inwards - kFreeEs) / (kWithFrontEs - kFreeEs));
    all[i] = tie;
  });
  std::erase_if(all, [](const SkinTie& tie) { return !(tie.share > 1e-3); });
  return all;
}

}  // namespace volto::rig
