#include "frames/arkit_blendshapes.h"

#include <algorithm>
#include <cctype>
#include <string>

namespace volto {

const std::array<std::string_view, kArkitBlendshapeCount> kArkitBlendshapeNames = {
    "eyeBlinkLeft",      "eyeLookDownLeft",    "eyeLookInLeft",      "eyeLookOutLeft",      "eyeLookUpLeft",
    "eyeSquintLeft",     "eyeWideLeft",        "eyeBlinkRight",      "eyeLookDownRight",    "eyeLookInRight",
    "eyeLookOutRight",   "eyeLookUpRight",     "eyeSquintRight",     "eyeWideRight",        "jawForward",
    "jawRight",          "jawLeft",            "jawOpen",            "mouthClose",          "mouthFunnel",
    "mouthPucker",       "mouthRight",         "mouthLeft",          "mouthSmileLeft",      "mouthSmileRight",
    "mouthFrownLeft",    "mouthFrownRight",    "mouthDimpleLeft",    "mouthDimpleRight",    "mouthStretchLeft",
    "mouthStretchRight", "mouthRollLower",     "mouthRollUpper",     "mouthShrugLower",     "mouthShrugUpper",
    "mouthPressLeft",    "mouthPressRight",    "mouthLowerDownLeft", "mouthLowerDownRight", "mouthUpperUpLeft",
    "mouthUpperUpRight", "browDownLeft",       "browDownRight",      "browInnerUp",         "browOuterUpLeft",
    "browOuterUpRight",  "cheekPuff",          "cheekSquintLeft",    "cheekSquintRight",    "noseSneerLeft",
    "noseSneerRight",    "tongueOut"};

namespace {

bool sameLetters(std::string_view a, std::string_view b) {
  return std::ranges::equal(a, b, [](unsigned char x, unsigned char y) { return std::tolower(x) == std::tolower(y); });
}

}  // namespace

std::optional<std::size_t> arkitBlendshapeIndex(std::string_view name) {
  for (std::size_t i = 0; i < kArkitBlendshapeCount; ++i)
    if (sameLetters(kArkitBlendshapeNames[i], name)) return i;
  return std::nullopt;
}

std::size_t arkitMirrorIndex(std::size_t index) {
  // Looked up once: this is asked in per-frame loops, where a search and a string per call would be felt.
  static const auto kMirror = [] {
    std::array<std::size_t, kArkitBlendshapeCount> mirror{};
    for (std::size_t i = 0; i < mirror.size(); ++i) {
      std::string name(kArkitBlendshapeNames[i]);
      if (name.ends_with("Left"))
        name.replace(name.size() - 4, 4, "Right");
      else if (name.ends_with("Right"))
        name.replace(name.size() - 5, 5, "Left");
      mirror[i] = arkitBlendshapeIndex(name).value_or(i);
    }
    return mirror;
  }();
  return kMirror.at(index);
}

}  // namespace volto
