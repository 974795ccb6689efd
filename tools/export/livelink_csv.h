// Live Link Face CSV: the 61 columns that Unreal Engine and many other programs import.
#pragma once

#include <cstdint>
#include <string>

#include "frames/avatar_frame.h"
#include "rig/rig.h"

namespace volto::exporter {

// The header line.
std::string liveLinkHeader();

// Rows of one character's performance. A shape that the character has not, or the input does not show, is 0, as the
// format has no other way to say it.
class LiveLinkRows {
 public:
  // Throws rig::InputError when none of the character's blendshapes has an ARKit name.
  explicit LiveLinkRows(const rig::Rig& rig);

  // "HH:MM:SS:FF.fff,61,...": t_ns as a time of day with 60 frames a second, to a thousandth of a frame: the true time,
  // not a frame number. Angles as the phone counts them, radians.
  void append(std::string& out, std::int64_t t_ns, const AvatarFrame& avatar) const;

 private:
  std::vector<int> column_;  // of each of the character's blendshapes, -1: none
};

}  // namespace volto::exporter
