#include "transfer/closing.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Core>

#include "rig/contacts.h"

namespace volto::transfer {
namespace {

constexpr float kShut = 0.1F;     // of the gap at rest
constexpr float kShutEs = 0.01F;  // or of the eye separation
constexpr int kRounds = 4;        // neighbours of a column give way too

using Float3 = std::array<float, 3>;
using Gaps = std::array<float, rig::kMaxSlitColumns>;

// Per column: what is open on the target and should not be.
Gaps tooOpen(const rig::SlitContact& slit, const Gaps& shut, const Gaps& allowed, std::span<const Float3> result) {
  Gaps out = rig::slitGaps(slit, result);
  for (std::size_t j = 0; j < slit.upper.size(); ++j) out[j] = shut[j] * std::max(0.0F, out[j] - allowed[j]);
  return out;
}

// 1 where the source is shut, fading to 0 where it is twice as open as that.
Gaps shutColumns(const rig::SlitContact& slit, float eye_separation, std::span<const Float3> neutral,
                 std::span<const Float3> example) {
  const Gaps rest = rig::slitGaps(slit, neutral), now = rig::slitGaps(slit, example);
  Gaps out{};
  for (std::size_t j = 0; j < slit.upper.size(); ++j) {
    const float limit = std::max(kShut * rest[j], kShutEs * eye_separation);
    out[j] = std::clamp(2 - now[j] / limit, 0.0F, 1.0F);
  }
  return out;
}

void close(const rig::SlitContact& slit, const rig::BallContact* ball, const Gaps& open, std::span<Float3> result) {
  const Eigen::Vector3f up(slit.up[0], slit.up[1], slit.up[2]);
  for (std::size_t i = 0; i < slit.vertex.size(); ++i) {
    const auto j = std::min(static_cast<std::size_t>(slit.column[i]), slit.upper.size() - 2);
    const float t = slit.column[i] - static_cast<float>(j), gap = open[j] + t * (open[j + 1] - open[j]);
    if (!(gap > 0)) continue;
    const float by = gap * (slit.share[i] > 0 ? -slit.upper_share : slit.upper_share - 1) * slit.share[i];
    Eigen::Map<Eigen::Vector3f> p(result[slit.vertex[i]].data());
    Eigen::Vector3f way = up;
    if (ball != nullptr) {
      const Eigen::Vector3f arm = p - Eigen::Map<const Eigen::Vector3f>(ball->centre.data());
      const Eigen::Vector3f tangent = up - up.dot(arm) / std::max(arm.squaredNorm(), 1e-12F) * arm;
      way = tangent / std::max(up.dot(tangent), 0.5F);
    }
    p += by * way;
  }
}

}  // namespace

void closeAsSource(const rig::Rig& source, std::span<const Float3> neutral, std::span<const Float3> example,
                   const rig::Rig& target, std::span<const Float3> target_neutral, std::span<Float3> result) {
  for (const rig::SlitContact& t : target.contacts.slits)
    for (const rig::SlitContact& s : source.contacts.slits) {
      if (s.place != t.place || s.upper.size() != t.upper.size()) continue;
      const auto es = static_cast<float>(source.fapu.fapu.eye_separation);
      const Gaps shut = shutColumns(s, es, neutral, example);
      // Where the source is shut at rest already, the target is as open as it is at rest.
      const Gaps source_rest = rig::slitGaps(s, neutral), target_rest = rig::slitGaps(t, target_neutral);
      Gaps allowed{};
      for (std::size_t j = 0; j < t.upper.size(); ++j)
        if (source_rest[j] < 2 * kShutEs * es) allowed[j] = std::max(0.0F, target_rest[j]);
      const rig::BallContact* ball = t.ball < 0 ? nullptr : &target.contacts.balls[static_cast<std::size_t>(t.ball)];
      for (int round = 0; round < kRounds; ++round) close(t, ball, tooOpen(t, shut, allowed, result), result);
    }
}

}  // namespace volto::transfer
