// What a face's motion must respect, whatever drives it: skin does not enter an eyeball, lips and lids do not pass each
// other, lids stay on their ball, lashes ride on their lid, skin does not turn over. Found once per character by
// findContacts (rig/find_contacts.h) and guardAgainstFolds (rig/fold_guard.h), applied to every deformed mesh by
// resolveContacts: some microseconds, nothing allocated, the neutral mesh stays as it is to the bit.
//
// Everything is in the mesh's own frame and unit. All functions are reentrant.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "rig/fold_guard.h"

namespace volto::rig {

// The skin over an eyeball: a vertex keeps at least its own distance from the centre, so that a lid which the mask
// moves along a chord runs along the ball.
struct BallContact {
  std::array<float, 3> centre{};
  float radius = 0;                   // of the eyeball, > 0
  std::vector<std::uint32_t> vertex;  // ascending
  std::vector<float> distance;        // one per vertex, > 0: never nearer to the centre than this
  // One per vertex, or none at all: a lid is not lifted off the ball either. What is farther from the centre than
  // `outer` comes back by the share `hold`, 0..1: 1 at the margins.
  std::vector<float> outer, hold;
};

// The two sides of mouth or eye. Columns are spread from corner to corner, wherever the corners are now; in each the
// upper margin stays above what is opposite to it then of the lower, as far as it did at rest. What is missing is taken
// half by each side (upper_share), and fades out along the skin.
struct SlitContact {
  enum class Place : std::uint8_t { mouth = 0, left_eye = 1, right_eye = 2 };
  // A point of a margin: between two vertices.
  struct Sample {
    std::uint32_t first = 0, second = 0;
    float share_of_second = 0;  // 0..1
  };
  Place place = Place::mouth;
  std::int32_t ball = -1;            // index into Contacts::balls: the sides give way along that ball; -1: along `up`
  std::array<float, 3> up{};         // unit: from the lower side to the upper
  float upper_share = 0.5F;          // of what is missing, 0..1
  std::vector<Sample> upper, lower;  // one per column at rest, in order from the subject's right to left; at least 2
  std::vector<float> least_gap;      // one per column, <= 0: height of the upper sample above the lower, at least
  // Vertices that give way.
  std::vector<std::uint32_t> vertex;  // ascending
  std::vector<float> column;          // one per vertex, 0 .. columns - 1, between two columns too; at rest
  std::vector<float> share;           // one per vertex, -1..1: > 0 goes up with the upper side, < 0 down with the lower
  std::vector<float> reach;           // one per vertex, <= 0: how far it may lie beyond the middle between the margins
};

// A vertex that rides on the skin (a lash, the wet edge of a lid): it follows the change that contacts and corrections
// make to its anchors, and turns with them about the ball.
struct Rider {
  std::uint32_t vertex = 0;
  std::array<std::uint32_t, 3> anchor{};
  std::array<float, 3> weight{};  // sum 1
  std::int32_t ball = -1;         // index into Contacts::balls; -1: does not turn
};

struct Contacts {
  std::vector<BallContact> balls;
  std::vector<SlitContact> slits;
  std::vector<Rider> riders;
  FoldGuard folds;

  bool empty() const { return balls.empty() && slits.empty() && riders.empty() && folds.empty(); }
};

// Most columns that a slit may have: what is needed per column lives on the stack.
inline constexpr std::size_t kMaxSlitColumns = 64;

// Height of the upper margin above the lower along `up`, per column, between the margins as they are in `positions`.
std::array<float, kMaxSlitColumns> slitGaps(const SlitContact& slit, std::span<const std::array<float, 3>> positions);

// Moves `positions` (#V) out of contact. `neutral`: #V, where riders and their anchors are at rest.
void resolveContacts(const Contacts& contacts, std::span<const std::array<float, 3>> neutral,
                     std::span<std::array<float, 3>> positions);

// How deep the worst vertex is inside a ball, and how far the worst column's sides have passed each other beyond what
// they did at rest: 0 where nothing is. Mesh unit.
struct Penetration {
  float ball = 0;
  float lids = 0;
  float lips = 0;
};
Penetration measurePenetration(const Contacts& contacts, std::span<const std::array<float, 3>> positions);

}  // namespace volto::rig
