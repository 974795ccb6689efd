#include "tools/animation/animation_script.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <optional>

#include "rig/errors.h"

namespace volto::animation {
namespace {

constexpr std::size_t kHead = 3;
constexpr std::array<std::string_view, kHead> kHeadNames = {"headYaw", "headPitch", "headRoll"};
constexpr double kMostDegrees = 90;
constexpr std::size_t kDeepestRepeat = 16;

std::string_view trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(" \t\r");
  if (first == text.npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

std::vector<std::string_view> split(std::string_view text, std::string_view separators) {
  std::vector<std::string_view> out;
  while (!text.empty()) {
    const std::size_t end = text.find_first_of(separators);
    if (const std::string_view part = trimmed(text.substr(0, end)); !part.empty()) out.push_back(part);
    if (end == text.npos) break;
    text.remove_prefix(end + 1);
  }
  return out;
}

// For messages: not longer than a line.
std::string quoted(std::string_view text) {
  std::string out(1, '\'');
  out.append(text.substr(0, 80));
  out += '\'';
  return out;
}

std::optional<double> numberIn(std::string_view text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) return {};
  return value;
}

double eased(Easing easing, double t) {
  switch (easing) {
    case Easing::smooth:
      return t * t * (3 - 2 * t);
    case Easing::in:
      return t * t;
    case Easing::out:
      return t * (2 - t);
    default:
      return t;
  }
}

}  // namespace

class ScriptParser {
 public:
  ScriptParser(std::string_view text, const std::string& name, std::span<const std::string> shapes,
               const AnimationScript::Suggest& suggest, const ScriptLimits& limits)
      : text_(text), name_(name), shapes_(shapes.begin(), shapes.end()), suggest_(suggest), limits_(limits) {
    for (std::size_t k = 0; k < shapes_.size(); ++k) index_[shapes_[k]] = {{k, 1.0}};
    for (std::size_t h = 0; h < kHead; ++h) index_[std::string(kHeadNames[h])] = {{shapes_.size() + h, 1.0}};
  }

  AnimationScript parse() {
    read();
    if (!open_.empty()) fail(open_.back().line, "this repeat has no end; add a line 'end'");
    script_.shapes_ = shapes_.size();
    state_.assign(shapes_.size() + kHead, 0.0F);
    script_.state_ = state_;
    play(steps_);
    if (script_.end_s_.empty())
      throw rig::InputError(name_ + ": no step in this script; a first one: to 0.5: jawOpen 1");
    return std::move(script_);
  }

 private:
  using Parts = std::vector<std::pair<std::size_t, double>>;  // index of a shape or head angle, factor
  struct Step {
    explicit Step(std::size_t at_line) : line(at_line) {}
    std::size_t line;
    double duration_s = 0;
    Easing easing = Easing::linear;
    bool everything = false;  // what is not named goes to rest
    std::vector<std::pair<std::size_t, float>> goals;
    std::uint64_t times = 0;  // > 0: a repeat
    std::vector<Step> body;
  };

  [[noreturn]] void fail(std::size_t line, const std::string& what) const {
    throw rig::InputError(name_ + ":" + std::to_string(line) + ": " + what);
  }

  void read() {
    std::size_t line = 0;
    for (std::string_view rest = text_; !rest.empty();) {
      const std::size_t end = rest.find('\n');
      std::string_view here = rest.substr(0, end);
      rest = end == rest.npos ? std::string_view() : rest.substr(end + 1);
      ++line;
      here = trimmed(here.substr(0, here.find('#')));
      if (here.empty()) continue;
      if (here.find('\0') != here.npos) fail(line, "a byte that is no text; is this an animation script?");
      statement(here, line);
    }
  }

  void statement(std::string_view text, std::size_t line) {
    const std::string_view word = text.substr(0, text.find_first_of(" \t:"));
    const std::string_view rest = trimmed(text.substr(word.size()));
    if (numberIn(word) || word.find_first_of("0123456789") == 0 || word.starts_with('-')) {
      plain(text, line);
    } else if (word == "define") {
      define(rest, line);
    } else if (word == "to") {
      to(rest, line);
    } else if (word == "hold") {
      Step step(line);
      step.duration_s = duration(rest, line);
      add(std::move(step));
    } else if (word == "neutral") {
      Step step(line);
      step.everything = true;
      timing(rest.empty() ? "0.5" : rest, line, step);
      add(std::move(step));
    } else if (word == "repeat") {
      Step step(line);
      std::uint64_t times = 0;
      const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), times);
      if (error != std::errc() || end != rest.data() + rest.size() || times == 0)
        fail(line, "repeat " + quoted(rest) + ": give how often, a whole number from 1 on");
      if (open_.size() >= kDeepestRepeat) fail(line, "repeats inside repeats, more than 16 deep");
      step.times = times;
      open_.push_back(std::move(step));
    } else if (word == "end") {
      if (open_.empty()) fail(line, "an end without its repeat");
      Step done = std::move(open_.back());
      open_.pop_back();
      add(std::move(done));
    } else {
      static const std::vector<std::string> kWords = {"to", "hold", "neutral", "repeat", "end", "define"};
      const std::string nearest = suggest_(word, kWords);
      fail(line, quoted(word) + " is no statement" +
                     (nearest.empty() ? "; to, hold, neutral, repeat, end and define are"
                                      : "; did you mean " + nearest + "?"));
    }
  }

  double duration(std::string_view text, std::size_t line) const {
    const auto seconds = numberIn(text);
    if (!seconds) fail(line, quoted(text) + " is no duration; give seconds, as 0.5");
    if (*seconds < 0) fail(line, "a duration of " + std::string(text) + " s; time does not run backward");
    return *seconds;
  }

  // "0.4 smooth"
  void timing(std::string_view text, std::size_t line, Step& step) const {
    const auto words = split(text, " \t");
    if (words.empty()) fail(line, "no duration; give seconds, as in to 0.5: jawOpen 1");
    step.duration_s = duration(words[0], line);
    if (words.size() == 1) return;
    if (words.size() > 2) fail(line, "more than a duration and an easing before the ':'");
    if (words[1] == "linear") {
      step.easing = Easing::linear;
    } else if (words[1] == "smooth") {
      step.easing = Easing::smooth;
    } else if (words[1] == "in") {
      step.easing = Easing::in;
    } else if (words[1] == "out") {
      step.easing = Easing::out;
    } else {
      fail(line, quoted(words[1]) + " is no easing; linear, smooth, in and out are");
    }
  }

  void to(std::string_view rest, std::size_t line) {
    const std::size_t colon = rest.find(':');
    if (colon == rest.npos) fail(line, "no ':' between the duration and the shapes, as in to 0.5: jawOpen 1");
    Step step(line);
    timing(rest.substr(0, colon), line, step);
    const auto parts = split(rest.substr(colon + 1), ",");
    if (parts.empty()) fail(line, "no shapes; name at least one, or use hold");
    for (const std::string_view part : parts) {
      const auto [name, value] = nameAndNumber(part, line);
      for (const auto& [index, factor] : lookUp(name, line)) {
        const double goal = value * factor;
        check(index, goal, name, line);
        step.goals.emplace_back(index, static_cast<float>(goal));
      }
    }
    add(std::move(step));
  }

  void define(std::string_view rest, std::size_t line) {
    const std::size_t equals = rest.find('=');
    if (equals == rest.npos) fail(line, "no '='; as in define smile = mouthSmileLeft 1, mouthSmileRight 1");
    const std::string name(trimmed(rest.substr(0, equals)));
    if (name.empty() || name.find_first_of(" \t,:") != name.npos) fail(line, quoted(name) + " is no name; one word");
    if (index_.contains(name)) fail(line, quoted(name) + " is there already; choose another name");
    Parts parts;
    for (const std::string_view part : split(rest.substr(equals + 1), ",")) {
      const auto [of, factor] = nameAndNumber(part, line);
      for (const auto& [index, f] : lookUp(of, line)) parts.emplace_back(index, f * factor);
    }
    if (parts.empty()) fail(line, quoted(name) + " is made of nothing");
    index_[name] = std::move(parts);
  }

  // Name and number; the number may be left out and is then 1. A name may hold spaces.
  std::pair<std::string, double> nameAndNumber(std::string_view part, std::size_t line) const {
    const std::size_t space = part.find_last_of(" \t");
    if (space != part.npos)
      if (const auto value = numberIn(part.substr(space + 1)))
        return {std::string(trimmed(part.substr(0, space))), *value};
    if (index_.contains(std::string(part))) return {std::string(part), 1.0};
    if (space != part.npos && index_.contains(std::string(trimmed(part.substr(0, space)))))
      fail(line, quoted(part.substr(space + 1)) + " is no number");
    return {std::string(part), 1.0};
  }

  const Parts& lookUp(const std::string& name, std::size_t line) const {
    const auto found = index_.find(name);
    if (found != index_.end()) return found->second;
    std::vector<std::string> known;
    for (const auto& [n, parts] : index_) known.push_back(n);
    const std::string nearest = suggest_(name, known);
    fail(line, "the character has no shape " + quoted(name) +
                   (nearest.empty() ? "; volto inspect lists them" : "; did you mean " + nearest + "?"));
  }

  void check(std::size_t index, double value, const std::string& name, std::size_t line) const {
    if (index < shapes_.size() && !(value >= 0 && value <= 1))
      fail(line, name + " comes to " + shown(value) + "; weights are 0 to 1");
    if (index >= shapes_.size() && !(std::abs(value) <= kMostDegrees))
      fail(line, name + " comes to " + shown(value) + " degrees; a head turns by 90 at most");
  }
  static std::string shown(double value) {
    char text[32];
    std::snprintf(text, sizeof text, "%.4g", value);
    return text;
  }

  void plain(std::string_view text, std::size_t line) {
    const auto numbers = split(text, " \t,;");
    Step step(line);
    step.duration_s = duration(numbers[0], line);
    if (numbers.size() != shapes_.size() + 1)
      fail(line, "a duration and " + std::to_string(numbers.size() - 1) + " weights; the character has " +
                     std::to_string(shapes_.size()) + " shapes");
    for (std::size_t k = 0; k < shapes_.size(); ++k) {
      const auto weight = numberIn(numbers[k + 1]);
      if (!weight) fail(line, quoted(numbers[k + 1]) + " is no weight");
      check(k, *weight, shapes_[k], line);
      step.goals.emplace_back(k, static_cast<float>(*weight));
    }
    add(std::move(step));
  }

  void add(Step step) { (open_.empty() ? steps_ : open_.back().body).push_back(std::move(step)); }

  // How long and how many, before anything is unrolled: a billion repetitions cost nothing to refuse.
  struct Extent {
    double seconds = 0, steps = 0;
  };
  Extent extentOf(const std::vector<Step>& steps) const {
    Extent sum;
    for (const Step& step : steps) {
      Extent one{step.duration_s, 1};
      if (step.times > 0) {
        one = extentOf(step.body);
        one.seconds *= static_cast<double>(step.times);
        one.steps *= static_cast<double>(step.times);
      }
      sum.seconds += one.seconds;
      sum.steps += one.steps;
      if (sum.seconds > limits_.longest_s)
        fail(step.line, "from here on the script lasts " + shown(sum.seconds / 3600) + " hours; the limit is " +
                            shown(limits_.longest_s / 3600) + ". Play a shorter one with --loop");
      if (sum.steps > static_cast<double>(limits_.most_steps))
        fail(step.line, "with its repetitions the script has " + shown(sum.steps) + " steps; the limit is " +
                            std::to_string(limits_.most_steps) + ". Play a shorter one with --loop");
    }
    return sum;
  }

  void play(const std::vector<Step>& steps) {
    extentOf(steps);
    unroll(steps);
  }
  void unroll(const std::vector<Step>& steps) {
    for (const Step& step : steps) {
      if (step.times > 0) {
        if (extentOf(step.body).steps == 0) continue;  // nothing, a billion times
        for (std::uint64_t i = 0; i < step.times; ++i) unroll(step.body);
        continue;
      }
      if (step.everything) std::fill(state_.begin(), state_.end(), 0.0F);
      for (const auto& [index, value] : step.goals) state_[index] = value;
      script_.end_s_.push_back(script_.durationS() + step.duration_s);
      script_.easing_.push_back(step.easing);
      script_.state_.insert(script_.state_.end(), state_.begin(), state_.end());
    }
  }

  std::string_view text_;
  const std::string& name_;
  std::vector<std::string> shapes_;
  const AnimationScript::Suggest& suggest_;
  ScriptLimits limits_;
  std::map<std::string, Parts> index_;
  std::vector<Step> steps_, open_;
  std::vector<float> state_;
  AnimationScript script_;
};

AnimationScript AnimationScript::parse(std::string_view text, const std::string& name_for_errors,
                                       std::span<const std::string> shapes, const Suggest& suggest,
                                       const ScriptLimits& limits) {
  return ScriptParser(text, name_for_errors, shapes, suggest, limits).parse();
}

void AnimationScript::at(double t_s, Moment& out) const {
  const std::size_t width = shapes_ + kHead;
  const auto step = static_cast<std::size_t>(std::upper_bound(end_s_.begin(), end_s_.end(), t_s) - end_s_.begin());
  const std::size_t before = std::min(step, end_s_.size()), after = std::min(step + 1, end_s_.size());
  double share = 0;
  if (step < end_s_.size()) {
    const double start = step == 0 ? 0 : end_s_[step - 1];
    const double length = end_s_[step] - start;
    share = length > 0 ? eased(easing_[step], std::clamp((t_s - start) / length, 0.0, 1.0)) : 1;
  }
  const auto value = [&](std::size_t i) {
    const double a = state_[before * width + i], b = state_[after * width + i];
    return static_cast<float>(a + share * (b - a));
  };
  out.weights.resize(shapes_);
  for (std::size_t k = 0; k < shapes_; ++k) out.weights[k] = value(k);
  for (std::size_t h = 0; h < kHead; ++h) out.head_degrees[h] = value(shapes_ + h);
}

}  // namespace volto::animation
