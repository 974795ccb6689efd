#include "transfer/lid_ring.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Geometry>

#include "rig/closest_point.h"
#include "transfer/surface.h"

namespace volto::transfer {
namespace {

constexpr double kOneLid = 0.75;
// Of a column's width (rig/contacts.h). The turn bends what stands off the margin, the way only shifts it.
constexpr double kEvenWay = 1.0, kEvenTurn = 4.0;

using Vectors = std::vector<Eigen::Vector3d>;

// Gaussian mean around the ring.
Vectors evened(const Vectors& values, double width) {
  const auto n = static_cast<std::ptrdiff_t>(values.size());
  const auto reach = std::min(static_cast<std::ptrdiff_t>(std::ceil(3 * width)), n / 2 - 1);
  Vectors out(values.size(), Eigen::Vector3d::Zero());
  for (std::ptrdiff_t i = 0; i < n; ++i) {
    double total = 0;
    for (std::ptrdiff_t d = -reach; d <= reach; ++d) {
      const double w = std::exp(-0.5 * static_cast<double>(d * d) / (width * width));
      out[static_cast<std::size_t>(i)] += w * values[static_cast<std::size_t>((i + d + n) % n)];
      total += w;
    }
    out[static_cast<std::size_t>(i)] /= total;
  }
  return out;
}

// Axis times angle of the smallest turn from one direction to another.
Eigen::Vector3d turnBetween(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  const Eigen::AngleAxisd turn(Eigen::Quaterniond::FromTwoVectors(from, to));
  return turn.angle() * turn.axis();
}

Eigen::Vector3d turned(const Eigen::Vector3d& v, const Eigen::Vector3d& by) {
  const double angle = by.norm();
  return angle > 1e-9 ? Eigen::Vector3d(Eigen::AngleAxisd(angle, by / angle) * v) : v;
}

}  // namespace

LidRing::LidRing(const rig::Rig& rig, const rig::SlitContact& slit) : neutral_(rig.neutral.positions) {
  samples_ = slit.upper;
  samples_.insert(samples_.end(), slit.lower.rbegin(), slit.lower.rend());
  upper_ = slit.upper.size();
  for (const rig::SlitContact::Sample& s : samples_) at_rest_.push_back(at(neutral_, s));
  turns_ = slit.ball >= 0;
  if (turns_)
    centre_ = Eigen::Map<const Eigen::Vector3f>(rig.contacts.balls[static_cast<std::size_t>(slit.ball)].centre.data())
                  .cast<double>();
}

double LidRing::nearest(const Eigen::Vector3d& p, std::size_t first, std::size_t end, Tied& out) const {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t k = first; k + 1 < end; ++k) {
    const Eigen::Vector3d &a = at_rest_[k], &b = at_rest_[k + 1];
    const double share = rig::shareOnSegment(p, a, b);
    const Eigen::Vector3d offset = p - (a + share * (b - a));
    if (offset.squaredNorm() >= least) continue;
    least = offset.squaredNorm();
    out.from = static_cast<std::uint32_t>(k);
    out.share = share;
    out.offset = offset;
  }
  return least;
}

void LidRing::add(const std::vector<std::uint32_t>& vertices) {
  std::vector<Tied> upper, lower;
  std::vector<bool> above;
  for (const std::uint32_t v : vertices) {
    const Eigen::Vector3d p = neutral_.row(v);
    upper.push_back({.vertex = v});
    lower.push_back({.vertex = v});
    const double to_upper = nearest(p, 0, upper_, upper.back());
    above.push_back(to_upper <= nearest(p, upper_, samples_.size(), lower.back()));
  }
  const auto count = static_cast<double>(std::count(above.begin(), above.end(), true));
  const double share = count / std::max(1.0, static_cast<double>(vertices.size()));
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    const bool to_upper = share >= kOneLid || (share > 1 - kOneLid && above[i]);
    tied_.push_back(to_upper ? upper[i] : lower[i]);
  }
}

void LidRing::apply(rig::VertexPositions& positions) const {
  if (tied_.empty()) return;
  Vectors way, turn;
  for (std::size_t k = 0; k < samples_.size(); ++k) {
    const Eigen::Vector3d now = at(positions, samples_[k]);
    way.push_back(now - at_rest_[k]);
    turn.push_back(turns_ ? turnBetween(at_rest_[k] - centre_, now - centre_) : Eigen::Vector3d::Zero());
  }
  way = evened(way, kEvenWay);
  turn = evened(turn, kEvenTurn);
  for (const Tied& t : tied_) {
    const auto between = [&](const Vectors& of) -> Eigen::Vector3d {
      return of[t.from] + t.share * (of[t.from + 1] - of[t.from]);
    };
    positions.row(t.vertex) = (between(at_rest_) + between(way) + turned(t.offset, between(turn))).transpose();
  }
}

}  // namespace volto::transfer
