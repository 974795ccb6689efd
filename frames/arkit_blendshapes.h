// The 52 ARKit blendshape names: the vocabulary that weights are spoken in.
#pragma once

#include <array>
#include <bitset>
#include <cstddef>
#include <optional>
#include <string_view>

namespace volto {

inline constexpr std::size_t kArkitBlendshapeCount = 52;

// In the column order of a Live Link Face CSV file, camelCase as ARKit spells them ("eyeBlinkLeft"). Left and right are the
// subject's. The index of a name in this array is its index in every array of 52 weights in Volto.
extern const std::array<std::string_view, kArkitBlendshapeCount> kArkitBlendshapeNames;

// Index of a name; upper and lower case do not matter ("EyeBlinkLeft" is found too). Nothing for an unknown name.
std::optional<std::size_t> arkitBlendshapeIndex(std::string_view name);

// The shape of the other side: eyeBlinkLeft <-> eyeBlinkRight, jawLeft <-> jawRight; a shape in the middle is its own mirror.
std::size_t arkitMirrorIndex(std::size_t index);

using ArkitWeights = std::array<float, kArkitBlendshapeCount>;     // 0..1 each
using ArkitObserved = std::bitset<kArkitBlendshapeCount>;          // which shapes the input can show at all

}  // namespace volto
