#include "transfer/added_examples.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "rig/pose.h"

namespace volto::transfer {
namespace {

constexpr double kPassingEs = 0.15;    // no shape that is meant by itself does that
constexpr double kPassingStill = 0.4;  // of what passes without the other one
constexpr double kAwayStill = 0.4;     // of how far it is from rest without the other one

// How the sides of a slit are to each other, beyond what they are at rest.
struct Gap {
  double passing = 0;  // deepest column
  double away = 0;     // mean over the columns of how far each is from rest
};

Gap measure(const rig::SlitContact& slit, std::span<const float> rest, const std::vector<rig::Position>& positions) {
  const auto now = rig::slitGaps(slit, positions);
  Gap out;
  for (std::size_t j = 0; j < slit.upper.size(); ++j) {
    const auto more = static_cast<double>(now[j] - rest[j]);
    out.passing = std::max(out.passing, static_cast<double>(slit.least_gap[j] - now[j]));
    out.away += std::abs(more) / static_cast<double>(slit.upper.size());
  }
  return out;
}

}  // namespace

rig::VertexPositions together(const rig::VertexPositions& neutral, const rig::VertexPositions& a,
                              const rig::VertexPositions& b) {
  return a + (b - neutral);
}

std::vector<std::int32_t> addedTo(const rig::Contacts& contacts, double eye_separation,
                                  const rig::VertexPositions& neutral, std::span<const rig::VertexPositions> examples) {
  std::vector<std::int32_t> out(examples.size(), -1);
  const std::vector<rig::Position> at_rest = rig::inSinglePrecision(neutral);
  for (const rig::SlitContact& slit : contacts.slits) {
    const auto rest = rig::slitGaps(slit, at_rest);
    std::vector<Gap> alone;
    for (const rig::VertexPositions& example : examples)
      alone.push_back(measure(slit, rest, rig::inSinglePrecision(example)));
    for (std::size_t e = 0; e < examples.size(); ++e) {
      if (out[e] >= 0 || alone[e].passing < kPassingEs * eye_separation) continue;
      double least = 0;
      for (std::size_t f = 0; f < examples.size(); ++f) {
        if (f == e) continue;
        const Gap sum =
            measure(slit, rest, rig::inSinglePrecision(together(neutral, examples[e], examples[f])));
        if (sum.passing > kPassingStill * alone[e].passing || sum.away > kAwayStill * alone[e].away) continue;
        if (out[e] >= 0 && sum.away >= least) continue;
        least = sum.away;
        out[e] = static_cast<std::int32_t>(f);
      }
    }
  }
  // One step only: what is added to a shape that is itself added to another one would need both.
  std::vector<std::int32_t> single = out;
  for (std::size_t e = 0; e < out.size(); ++e)
    if (out[e] >= 0 && out[static_cast<std::size_t>(out[e])] >= 0) single[e] = -1;
  return single;
}

}  // namespace volto::transfer
