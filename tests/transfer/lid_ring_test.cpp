#include "transfer/lid_ring.h"

#include <cmath>

#include <gtest/gtest.h>

namespace volto::transfer {
namespace {

constexpr int kColumns = 41;  // as an eye has (rig/find_contacts.cpp)
constexpr double kRadius = 10;

Eigen::Vector3d onBall(double x, double y) { return {x, y, std::sqrt(kRadius * kRadius - x * x - y * y)}; }

// An open eye: two margins on a ball around the origin, and a lash on each, in the middle and at the outer corner.
struct Eye : ::testing::Test {
  rig::Rig rig;
  std::vector<std::uint32_t> upper_lash, lower_lash;

  double height(int k) const {
    const double x = static_cast<double>(2 * k - (kColumns - 1)) / (kColumns - 1);
    return 3 * (1 - x * x);
  }
  double across(int k) const { return 16.0 * k / (kColumns - 1) - 8; }

  Eye() {
    std::vector<Eigen::Vector3d> points;
    rig::SlitContact slit;
    slit.place = rig::SlitContact::Place::left_eye;
    slit.ball = 0;
    for (const double side : {1.0, -1.0})
      for (int k = 0; k < kColumns; ++k) {
        const auto v = static_cast<std::uint32_t>(points.size());
        points.push_back(onBall(across(k), side * height(k)));
        (side > 0 ? slit.upper : slit.lower).push_back({v, v, 0});
      }
    const auto grow = [&](int k, double side, std::vector<std::uint32_t>& lash) {
      for (const double way : {0.0, 1.0, 2.0}) {
        lash.push_back(static_cast<std::uint32_t>(points.size()));
        points.push_back((1 + 0.1 * way) * onBall(across(k), side * height(k)) + Eigen::Vector3d(0, side * way, 0));
      }
    };
    grow(kColumns / 2, 1, upper_lash);
    grow(kColumns / 2, -1, lower_lash);
    rig.neutral.positions.resize(static_cast<Eigen::Index>(points.size()), 3);
    for (std::size_t v = 0; v < points.size(); ++v) rig.neutral.positions.row(static_cast<Eigen::Index>(v)) = points[v];
    rig.contacts.balls.push_back({.centre = {0, 0, 0}, .radius = kRadius, .vertex = {}, .distance = {}, .outer = {}, .hold = {}});
    rig.contacts.slits.push_back(slit);
  }

  // The upper lid lies on the lower one.
  rig::VertexPositions shut() const {
    rig::VertexPositions out = rig.neutral.positions;
    out.topRows(kColumns) = rig.neutral.positions.middleRows(kColumns, kColumns);
    return out;
  }
  LidRing ring() const { return LidRing(rig, rig.contacts.slits[0]); }
};

TEST_F(Eye, LashGoesWithItsLidAndTurnsWithIt) {
  LidRing lashes = ring();
  lashes.add(upper_lash);
  lashes.add(lower_lash);
  rig::VertexPositions now = shut();
  lashes.apply(now);
  const auto along = [&](const rig::VertexPositions& p, const std::vector<std::uint32_t>& lash) {
    return Eigen::Vector3d(p.row(lash[2]) - p.row(lash[0]));
  };
  const Eigen::Vector3d before = along(rig.neutral.positions, upper_lash), after = along(now, upper_lash);
  EXPECT_NEAR(after.norm(), before.norm(), 1e-9);
  // Its lid turned by 35 degrees.
  const double degrees = 57.2957795 * std::acos(before.dot(after) / before.squaredNorm());
  EXPECT_NEAR(degrees, 2 * 57.2957795 * std::asin(3 / kRadius), 4);
  EXPECT_LT((now.row(upper_lash[0]) - now.row(kColumns / 2)).norm(), 0.1);
  // The lower lid is held by the evened-out way of its corners alone.
  EXPECT_LT((along(now, lower_lash) - along(rig.neutral.positions, lower_lash)).norm(), 0.3);
}

TEST_F(Eye, AtRestNothingMoves) {
  LidRing lashes = ring();
  lashes.add(upper_lash);
  rig::VertexPositions now = rig.neutral.positions;
  lashes.apply(now);
  EXPECT_LT((now - rig.neutral.positions).cwiseAbs().maxCoeff(), 1e-12);
}

TEST_F(Eye, TipThatHangsOverTheOtherLidStaysWithItsLash) {
  // The last vertex of the lash comes down to the lower margin.
  rig.neutral.positions.row(upper_lash[2]) = rig.neutral.positions.row(kColumns + kColumns / 2) * 1.05;
  upper_lash.insert(upper_lash.begin(), {0, 1, 2, 3});  // more of it grows on the upper lid
  LidRing lashes = ring();
  lashes.add(upper_lash);
  rig::VertexPositions now = shut();
  lashes.apply(now);
  EXPECT_LT(now(upper_lash.back(), 1), rig.neutral.positions(upper_lash.back(), 1) - 2);
}

}  // namespace
}  // namespace volto::transfer
