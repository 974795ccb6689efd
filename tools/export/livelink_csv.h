// Live Link Face CSV: the 61 columns that Unreal Engine and many other programs import.
#pragma once

#include <cstdint>
#include <string>

#include "frames/avatar_frame.h"
#include "rig/rig.h"
#include "rig/shape_translation.h"

namespace volto::exporter {

// The header line.
std::string liveLinkHeader();

// Rows of one character's performance. A shape that the character has not, or the input does not show, is 0, as the
// format has no other way to say it.
class LiveLinkRows {
 public:
  // What the character's shapes are in ARKit's terms: rig/shape_translation.h. Throws rig::InputError.
  explicit LiveLinkRows(const rig::Rig& rig, const rig::ShapeSet* meaning = nullptr);

  // "HH:MM:SS:FF.fff,61,...": t_ns as a time of day with 60 frames a second, to a thousandth of a frame: the true time,
  // not a frame number. Angles as the phone counts them, radians.
  void append(std::string& out, std::int64_t t_ns, const AvatarFrame& avatar) const;

 private:
  rig::ShapeTranslation to_arkit_;
};

}  // namespace volto::exporter
