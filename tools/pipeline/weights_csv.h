// Weights and masks as text: what `volto track` and `volto bake --csv` write. No locale, the same bytes on every
// machine.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "frames/mask_frame.h"

namespace volto::pipeline {

// "timestamp,NAME,...,headYaw,headPitch,headRoll\n"
void appendWeightsHeader(std::string& out, std::span<const std::string> names);
// Seconds, weights with six decimals, head angles in degrees with four. A weight that is not observed is an empty cell,
// and so are the angles of a head that was not. `observed` is as long as `weights`.
void appendWeightsRow(std::string& out, std::int64_t t_ns, std::span<const float> weights,
                      std::span<const std::uint8_t> observed, const HeadPose& head);

// "timestamp,2.1_x,2.1_y,2.1_z,...\n"
void appendMaskHeader(std::string& out);
// Displacements in FAPU units, six decimals; the cells of a point about which nothing is known are empty.
void appendMaskRow(std::string& out, const MaskFrame& mask);

// "12.5167": seconds from nanoseconds, exact, at least four decimals.
void appendSeconds(std::string& out, std::int64_t t_ns);

}  // namespace volto::pipeline
