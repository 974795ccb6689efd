// A performance written down by a person: which shapes go where, and how long it takes. Two forms.
//
// Plain (Queiroz, Braun, Musse, section VI): each line a duration in seconds and one weight per shape of the character,
// in its order; weights go there linearly.
//
//   0.5  0 0 0.8 0 ...
//
// Readable, one statement per line, # begins a comment:
//
//   define smile = mouthSmileLeft 1, mouthSmileRight 0.9     a name for shapes that go together
//   to 0.4 smooth: smile 0.8, jawOpen 0.2, headYaw 10        go there; shapes that are not named stay as they are
//   hold 0.5
//   repeat 3
//     to 0.08: eyeBlinkLeft 1, eyeBlinkRight 1
//     to 0.12: eyeBlinkLeft 0, eyeBlinkRight 0
//   end
//   neutral 1 smooth                                         everything to rest, the head too
//
// Ways to go: linear (default), smooth (slow at both ends), in (slow start), out (slow end). Weights are 0 to 1;
// headYaw, headPitch and headRoll are degrees, signs as in tracker/head_pose.h.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace volto::animation {

enum class Easing : std::uint8_t { linear, smooth, in, out };

struct ScriptLimits {
  double longest_s = 24 * 3600;
  std::size_t most_steps = 100'000;  // with every repetition
};

class AnimationScript {
 public:
  // `shapes`: names of the character's blendshapes. `suggest`: the known name nearest to one that is not known, or
  // nothing. Throws rig::InputError "file:line: what; what to do".
  using Suggest = std::function<std::string(std::string_view, std::span<const std::string>)>;
  static AnimationScript parse(std::string_view text, const std::string& name_for_errors,
                               std::span<const std::string> shapes, const Suggest& suggest,
                               const ScriptLimits& limits = {});

  struct Moment {
    std::vector<float> weights;           // one per shape
    std::array<float, 3> head_degrees{};  // yaw, pitch, roll
  };
  // Before the beginning: at rest; after the end: as the last step left it. Reuses the memory of `out`. Reentrant.
  void at(double t_s, Moment& out) const;

  double durationS() const { return end_s_.empty() ? 0 : end_s_.back(); }
  std::size_t stepCount() const { return end_s_.size(); }

 private:
  friend class ScriptParser;
  std::size_t shapes_ = 0;
  std::vector<double> end_s_;   // per step: when it is done
  std::vector<Easing> easing_;  // per step
  std::vector<float> state_;    // steps + 1 by shapes + 3: at rest, then after each step
};

}  // namespace volto::animation
