// Skin that does not turn over: triangles that some expression brings near to it keep a little of the area that they
// show where they faced at rest. The last of a pose's contacts (rig/contacts.h), for whatever motion.
//
// For each such triangle the inequality  n . ((b - a) x (c - a)) >= least  with n its normal at rest; what is missing is
// taken by its three vertices along the inequality's gradient (Mueller et al., "Position based dynamics", 2007), one
// triangle after the other, for some rounds. Everything is in the mesh's own frame and unit. Reentrant.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace volto::rig {

struct FoldGuard {
  std::vector<std::array<std::uint32_t, 3>> triangle;  // first those that are looked at in every pose, `watched` many;
  std::size_t watched = 0;                             // then their neighbours, which must not be turned over for them
  std::vector<std::array<float, 3>> normal;            // unit: where it faces at rest
  std::vector<float> least;                            // > 0: twice the area that it shows in that direction, at least
  // Vertices at the same place as another one, on the other side of a seam: {copy, original}. They follow it.
  std::vector<std::array<std::uint32_t, 2>> copies;

  bool empty() const { return triangle.empty(); }
};

struct Rig;
struct Skin;

// Which triangles some expression or a pair of expressions brings near to turning over, and what is around them. `rig`:
// complete but for contacts.folds, which is not looked at.
FoldGuard guardAgainstFolds(const Rig& rig, const Skin& skin);

}  // namespace volto::rig
