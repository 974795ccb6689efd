#include "rig/contacts.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "rig/prepared_contacts.h"
#include "rig/unfold_rounds.h"
#include "rig/vec3.h"

namespace volto::rig {
namespace {

// With `drawn_back`, what was lifted off comes back too. `touched` gains what was pushed out.
void keepOnBall(const BallContact& ball, bool drawn_back, std::span<Vec3> positions,
                TouchedVertices* touched = nullptr) {
  const bool held = drawn_back && !ball.hold.empty();
  for (std::size_t i = 0; i < ball.vertex.size(); ++i) {
    Vec3& p = positions[ball.vertex[i]];
    const Vec3 arm = p - ball.centre;
    const float squared = dot(arm, arm), least = ball.distance[i];
    if (squared < least * least) {
      if (squared > 1e-12F * least * least) p = ball.centre + (least / std::sqrt(squared)) * arm;
      if (touched != nullptr) touched->add(ball.vertex[i]);
    } else if (held && ball.hold[i] > 0 && squared > ball.outer[i] * ball.outer[i]) {
      const float distance = std::sqrt(squared);
      p = ball.centre + ((distance + ball.hold[i] * (ball.outer[i] - distance)) / distance) * arm;
    }
  }
}

// The margins as they are now.
struct Columns {
  Vec3 across;           // unit, at right angles to `up`: from corner to corner
  float from, per_unit;  // column of a place: (across . place - from) * per_unit
  std::size_t last;
  std::array<float, kMaxSlitColumns> upper, lower;  // heights of the margins along `up`
  std::array<float, kMaxSlitColumns> missing;       // of the gap

  float columnOf(const Vec3& p, float otherwise) const {
    if (!(per_unit > 0)) return otherwise;
    const float column = (dot(across, p) - from) * per_unit;
    return column > 0 ? std::min(column, static_cast<float>(last)) : 0.0F;
  }
};

Vec3 placeOf(const SlitContact::Sample& s, std::span<const Vec3> positions) {
  const Vec3& first = positions[s.first];
  return first + s.share_of_second * (positions[s.second] - first);
}

// Height of one margin at each column, from its samples, which are at rest one per column and now wherever they are.
void measureMargin(const SlitContact& slit, const std::vector<SlitContact::Sample>& samples,
                   std::span<const Vec3> positions, const Columns& columns,
                   std::array<float, kMaxSlitColumns>& heights) {
  std::size_t next = 0;
  float column_before = 0, height_before = 0;
  for (std::size_t k = 0; k < samples.size(); ++k) {
    const Vec3 p = placeOf(samples[k], positions);
    const float height = dot(slit.up, p);
    // Margins do not run backwards.
    const float column = std::max(column_before, columns.columnOf(p, static_cast<float>(k)));
    for (; next <= columns.last && static_cast<float>(next) <= column; ++next) {
      const float step = column - column_before;
      const float t = k > 0 && step > 1e-6F ? (static_cast<float>(next) - column_before) / step : 1.0F;
      heights[next] = k > 0 ? height_before + t * (height - height_before) : height;
    }
    column_before = column;
    height_before = height;
  }
  for (; next <= columns.last; ++next) heights[next] = height_before;
}

Columns measureColumns(const SlitContact& slit, std::span<const Vec3> positions) {
  Columns out;
  out.last = slit.upper.size() - 1;
  const Vec3 from = 0.5F * (placeOf(slit.upper.front(), positions) + placeOf(slit.lower.front(), positions));
  const Vec3 way = 0.5F * (placeOf(slit.upper.back(), positions) + placeOf(slit.lower.back(), positions)) - from;
  const Vec3 flat = way - dot(slit.up, way) * slit.up;
  const float length = std::sqrt(dot(flat, flat));
  out.across = (length > 0 ? 1 / length : 0.0F) * flat;
  out.from = dot(out.across, from);
  out.per_unit = length > 0 ? static_cast<float>(out.last) / length : 0.0F;
  measureMargin(slit, slit.upper, positions, out, out.upper);
  measureMargin(slit, slit.lower, positions, out, out.lower);
  for (std::size_t j = 0; j <= out.last; ++j)
    out.missing[j] = std::max(0.0F, slit.least_gap[j] - (out.upper[j] - out.lower[j]));
  return out;
}

// `p` goes up by `by`; where there is a ball, around it along a meridian: as far from its centre as before.
void giveWay(const SlitContact& slit, const BallContact* ball, float by, Vec3& p) {
  if (ball != nullptr) {
    const Vec3 arm = p - ball->centre;
    const float squared = dot(arm, arm), height = dot(slit.up, arm), flat = squared - height * height;
    // Near the poles the surface hardly rises.
    if (flat > 0.05F * squared) {
      const float limit = 0.97F * std::sqrt(squared), now = std::clamp(height + by, -limit, limit);
      const float scale = std::sqrt((squared - now * now) / flat);
      p = ball->centre + scale * (arm - height * slit.up) + now * slit.up;
      return;
    }
  }
  p = p + by * slit.up;
}

// Whether something was moved.
bool partSides(const SlitContact& slit, const BallContact* ball, std::span<Vec3> positions) {
  bool moved = false;
  const Columns columns = measureColumns(slit, positions);
  for (std::size_t i = 0; i < slit.vertex.size(); ++i) {
    Vec3& p = positions[slit.vertex[i]];
    const float column = columns.columnOf(p, slit.column[i]), share = slit.share[i];
    const std::size_t a = std::min(static_cast<std::size_t>(column), columns.last), b = std::min(a + 1, columns.last);
    const float t = column - static_cast<float>(a);
    const auto between = [&](const auto& of) { return of[a] + t * (of[b] - of[a]); };
    const float missing = between(columns.missing);
    const float give = missing * (share > 0 ? slit.upper_share : 1 - slit.upper_share);
    if (missing > 0) giveWay(slit, ball, share * give, p), moved = true;
    // Whatever lies beyond the other side's margin by more than it did at rest.
    if (share > 0) {
      const float other = between(columns.lower) - (1 - slit.upper_share) * missing;
      const float beyond = other + slit.reach[i] - dot(slit.up, p);
      if (beyond > 0) giveWay(slit, ball, share * beyond, p), moved = true;
    } else {
      const float other = between(columns.upper) + slit.upper_share * missing;
      const float beyond = dot(slit.up, p) - (other - slit.reach[i]);
      if (beyond > 0) giveWay(slit, ball, share * beyond, p), moved = true;
    }
  }
  return moved;
}

// Triangles that were nearly turned over get back what they need; the lids stay out of the balls meanwhile.
// `known`: the guard's blocks where somebody has kept them.
void unfold(const Contacts& contacts, const TriangleBlocks* known, std::span<Vec3> positions) {
  constexpr int kMostRounds = 24, kBallsEvery = 4;
  if (contacts.folds.empty()) return;
  std::array<TouchedVertices, 2> touched;
  if (unfoldFirst(contacts.folds, contacts.folds.watched, touched[0], positions) == 0) return;
  std::optional<TriangleBlocks> made;
  const TriangleBlocks& blocks = known != nullptr ? *known : made.emplace(contacts.folds);
  for (int round = 1; round < kMostRounds; ++round) {
    TouchedVertices &reach = touched[static_cast<std::size_t>(round + 1) % 2],
                    &now = touched[static_cast<std::size_t>(round) % 2];
    now.clear();
    if (round % kBallsEvery == 0)
      for (const BallContact& ball : contacts.balls) keepOnBall(ball, false, positions, &now);
    reach.addAll(now);
    if (unfoldAround(contacts.folds, blocks, reach, now, positions) == 0) return;
  }
}

// What does not change of a rider.
struct RiderAtRest {
  Vec3 place{};   // its own
  Vec3 anchor{};  // of the point that it rides on
  // Where there is a ball: unit, from its centre to that point; from there to the rider.
  Vec3 arm{}, lever{};
};

RiderAtRest atRest(const Rider& rider, const BallContact* ball, std::span<const Vec3> neutral) {
  RiderAtRest out;
  for (std::size_t k = 0; k < 3; ++k) out.anchor = out.anchor + rider.weight[k] * neutral[rider.anchor[k]];
  out.place = neutral[rider.vertex];
  if (ball == nullptr) return out;
  out.lever = out.place - out.anchor;
  const Vec3 arm = out.anchor - ball->centre;
  if (const float length = std::sqrt(dot(arm, arm)); length > 0) out.arm = (1 / length) * arm;
  return out;
}

// Where the anchors went, and how they turned about the ball.
[[gnu::always_inline]] inline void ride(const Rider& rider, const RiderAtRest& rest, const BallContact* ball,
                                        std::span<Vec3> positions) {
  Vec3 now{};
  for (std::size_t k = 0; k < 3; ++k) now = now + rider.weight[k] * positions[rider.anchor[k]];
  const Vec3 moved = now - rest.anchor;
  Vec3 out = rest.place + moved;
  if (ball != nullptr && dot(moved, moved) > 0) {
    const Vec3 to = now - ball->centre;
    const float length = std::sqrt(dot(to, to)), along = dot(rest.arm, to);
    // The smallest rotation from `arm` to `to`, of which c and `along` hold sine and cosine times the length:
    // v + c x v + c x (c x v) / (1 + cos). Where there is no arm c is nothing.
    if (along > -0.9F * length) {
      const Vec3 c = cross(rest.arm, to), cv = cross(c, rest.lever);
      const float sum = length + along, share = 1 / (length * sum);
      out = out + (share * sum) * cv + share * cross(c, cv);
    }
  }
  positions[rider.vertex] = out;
}

const BallContact* ballOf(const Contacts& contacts, std::int32_t index) {
  return index < 0 ? nullptr : &contacts.balls[static_cast<std::size_t>(index)];
}

// All but the riders.
void settle(const Contacts& contacts, const TriangleBlocks* blocks, std::span<Vec3> positions) {
  for (const BallContact& ball : contacts.balls) keepOnBall(ball, true, positions);
  bool moved = false;  // beside a ball
  for (const SlitContact& slit : contacts.slits)
    if (partSides(slit, ballOf(contacts, slit.ball), positions)) moved = moved || slit.ball >= 0;
  if (moved)
    for (const BallContact& ball : contacts.balls) keepOnBall(ball, false, positions);
  unfold(contacts, blocks, positions);
}

}  // namespace

std::array<float, kMaxSlitColumns> slitGaps(const SlitContact& slit, std::span<const Vec3> positions) {
  const Columns columns = measureColumns(slit, positions);
  std::array<float, kMaxSlitColumns> out{};
  for (std::size_t j = 0; j <= columns.last; ++j) out[j] = columns.upper[j] - columns.lower[j];
  return out;
}

void resolveContacts(const Contacts& contacts, std::span<const Vec3> neutral, std::span<Vec3> positions) {
  settle(contacts, nullptr, positions);
  for (const Rider& rider : contacts.riders) {
    const BallContact* const ball = ballOf(contacts, rider.ball);
    ride(rider, atRest(rider, ball, neutral), ball, positions);
  }
}

struct PreparedContacts::State {
  Contacts contacts;
  TriangleBlocks blocks;
  std::vector<RiderAtRest> riders;
};

PreparedContacts::PreparedContacts(const Contacts& contacts, std::span<const Vec3> neutral) {
  auto state = std::make_unique<State>(State{contacts, TriangleBlocks(contacts.folds), {}});
  for (const Rider& rider : contacts.riders)
    state->riders.push_back(atRest(rider, ballOf(contacts, rider.ball), neutral));
  state_ = std::move(state);
}
PreparedContacts::~PreparedContacts() = default;
PreparedContacts::PreparedContacts(PreparedContacts&&) noexcept = default;
PreparedContacts& PreparedContacts::operator=(PreparedContacts&&) noexcept = default;

void PreparedContacts::resolve(std::span<Vec3> positions) const {
  const State& s = *state_;
  settle(s.contacts, &s.blocks, positions);
  for (std::size_t i = 0; i < s.riders.size(); ++i) {
    const Rider& rider = s.contacts.riders[i];
    ride(rider, s.riders[i], ballOf(s.contacts, rider.ball), positions);
  }
}

Penetration measurePenetration(const Contacts& contacts, std::span<const Vec3> positions) {
  Penetration out;
  for (const BallContact& ball : contacts.balls)
    for (std::size_t i = 0; i < ball.vertex.size(); ++i) {
      const Vec3 arm = positions[ball.vertex[i]] - ball.centre;
      out.ball = std::max(out.ball, std::min(ball.radius, ball.distance[i]) - std::sqrt(dot(arm, arm)));
    }
  for (const SlitContact& slit : contacts.slits) {
    const Columns columns = measureColumns(slit, positions);
    float& deepest = slit.place == SlitContact::Place::mouth ? out.lips : out.lids;
    for (std::size_t j = 0; j < slit.upper.size(); ++j) deepest = std::max(deepest, columns.missing[j]);
  }
  return out;
}

}  // namespace volto::rig
