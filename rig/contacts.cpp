#include "rig/contacts.h"

#include <algorithm>
#include <cmath>

namespace volto::rig {
namespace {

using Vec3 = std::array<float, 3>;

[[gnu::always_inline]] inline Vec3 operator+(const Vec3& a, const Vec3& b) {
  return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}
[[gnu::always_inline]] inline Vec3 operator-(const Vec3& a, const Vec3& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
[[gnu::always_inline]] inline Vec3 operator*(float s, const Vec3& a) { return {s * a[0], s * a[1], s * a[2]}; }
[[gnu::always_inline]] inline float dot(const Vec3& a, const Vec3& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
[[gnu::always_inline]] inline Vec3 cross(const Vec3& a, const Vec3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

void keepOutOfBall(const BallContact& ball, std::span<Vec3> positions) {
  for (std::size_t i = 0; i < ball.vertex.size(); ++i) {
    Vec3& p = positions[ball.vertex[i]];
    const Vec3 arm = p - ball.centre;
    const float squared = dot(arm, arm), least = ball.distance[i];
    if (squared < least * least && squared > 1e-12F * least * least)
      p = ball.centre + (least / std::sqrt(squared)) * arm;
  }
}

struct Column {
  float upper, lower;  // heights of the margins along `up`
  float missing;       // of the gap
};

// Heights of the margins and what is missing, per column.
void measureColumns(const SlitContact& slit, std::span<const Vec3> positions,
                    std::array<Column, kMaxSlitColumns>& columns) {
  const auto height = [&](const SlitContact::Sample& s) {
    const float first = dot(slit.up, positions[s.first]), second = dot(slit.up, positions[s.second]);
    return first + s.share_of_second * (second - first);
  };
  for (std::size_t j = 0; j < slit.upper.size(); ++j) {
    const float upper = height(slit.upper[j]), lower = height(slit.lower[j]);
    columns[j] = {upper, lower, std::max(0.0F, slit.least_gap[j] - (upper - lower))};
  }
}

// `p` goes up by `by`, along the ball's surface where there is one.
void giveWay(const SlitContact& slit, const BallContact* ball, float by, Vec3& p) {
  Vec3 way = slit.up;
  if (ball != nullptr) {
    const Vec3 arm = p - ball->centre;
    const float squared = dot(arm, arm);
    if (squared > 0) {
      const Vec3 tangent = slit.up - (dot(slit.up, arm) / squared) * arm;
      // Near the ball's poles the surface hardly rises: never more than twice as far along it as up.
      way = (1 / std::max(dot(slit.up, tangent), 0.5F)) * tangent;
    }
  }
  p = p + by * way;
}

void partSides(const SlitContact& slit, const BallContact* ball, std::span<Vec3> positions) {
  std::array<Column, kMaxSlitColumns> columns;
  measureColumns(slit, positions, columns);
  const std::size_t last = slit.upper.size() - 1;
  for (std::size_t i = 0; i < slit.vertex.size(); ++i) {
    const auto j = static_cast<std::size_t>(slit.column[i]);
    const Column& a = columns[std::min(j, last)];
    const Column& b = columns[std::min(j + 1, last)];
    const float t = slit.column[i] - static_cast<float>(j);
    const float missing = a.missing + t * (b.missing - a.missing), share = slit.share[i];
    Vec3& p = positions[slit.vertex[i]];
    const float give = missing * (share > 0 ? slit.upper_share : 1 - slit.upper_share);
    if (missing > 0) giveWay(slit, ball, share * give, p);
    // Whatever lies beyond the other side's margin by more than it did at rest.
    if (share > 0) {
      const float other = a.lower + t * (b.lower - a.lower) - (1 - slit.upper_share) * missing;
      const float beyond = other + slit.reach[i] - dot(slit.up, p);
      if (beyond > 0) giveWay(slit, ball, share * beyond, p);
    } else {
      const float other = a.upper + t * (b.upper - a.upper) + slit.upper_share * missing;
      const float beyond = dot(slit.up, p) - (other - slit.reach[i]);
      if (beyond > 0) giveWay(slit, ball, share * beyond, p);
    }
  }
}

// Where the anchors went, and how they turned about the ball.
void ride(const Rider& rider, const BallContact* ball, std::span<const Vec3> neutral, std::span<Vec3> positions) {
  Vec3 at_rest{}, now{}, moved{};
  for (std::size_t k = 0; k < 3; ++k) {
    at_rest = at_rest + rider.weight[k] * neutral[rider.anchor[k]];
    now = now + rider.weight[k] * positions[rider.anchor[k]];
    moved = moved + rider.weight[k] * (positions[rider.anchor[k]] - neutral[rider.anchor[k]]);
  }
  Vec3 out = neutral[rider.vertex] + moved;
  if (ball != nullptr && dot(moved, moved) > 0) {
    Vec3 from = at_rest - ball->centre, to = now - ball->centre;
    const float lengths = std::sqrt(dot(from, from) * dot(to, to));
    if (lengths > 0) {
      // The smallest rotation from `from` to `to`: v + c x v + c x (c x v) / (1 + cos).
      const Vec3 c = (1 / lengths) * cross(from, to), v = neutral[rider.vertex] - at_rest;
      const float cosine = dot(from, to) / lengths;
      const Vec3 cv = cross(c, v);
      if (cosine > -0.9F) out = out + cv + (1 / (1 + cosine)) * cross(c, cv);
    }
  }
  positions[rider.vertex] = out;
}

const BallContact* ballOf(const Contacts& contacts, std::int32_t index) {
  return index < 0 ? nullptr : &contacts.balls[static_cast<std::size_t>(index)];
}

}  // namespace

void resolveContacts(const Contacts& contacts, std::span<const Vec3> neutral, std::span<Vec3> positions) {
  for (const BallContact& ball : contacts.balls) keepOutOfBall(ball, positions);
  for (const SlitContact& slit : contacts.slits) partSides(slit, ballOf(contacts, slit.ball), positions);
  if (!contacts.slits.empty())
    for (const BallContact& ball : contacts.balls) keepOutOfBall(ball, positions);
  for (const Rider& rider : contacts.riders) ride(rider, ballOf(contacts, rider.ball), neutral, positions);
}

Penetration measurePenetration(const Contacts& contacts, std::span<const Vec3> positions) {
  Penetration out;
  for (const BallContact& ball : contacts.balls)
    for (std::size_t i = 0; i < ball.vertex.size(); ++i) {
      const Vec3 arm = positions[ball.vertex[i]] - ball.centre;
      out.ball = std::max(out.ball, std::min(ball.radius, ball.distance[i]) - std::sqrt(dot(arm, arm)));
    }
  std::array<Column, kMaxSlitColumns> columns;
  for (const SlitContact& slit : contacts.slits) {
    measureColumns(slit, positions, columns);
    float& deepest = slit.place == SlitContact::Place::mouth ? out.lips : out.lids;
    for (std::size_t j = 0; j < slit.upper.size(); ++j) deepest = std::max(deepest, columns[j].missing);
  }
  return out;
}

}  // namespace volto::rig
