#include "recordings/make/speech.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <stdexcept>
#include <string>

namespace volto::recordings {
namespace {

struct ShapeWeight {
  std::string_view shape;  // "mouthStretch": both sides
  double weight;
};

// One posture of the mouth. `strength`: how little it may be given up to its neighbours; `duration_s`: unstressed.
struct Viseme {
  std::string_view name;
  double strength, duration_s;
  std::array<ShapeWeight, 6> shapes;
};

constexpr std::array<Viseme, 17> kVisemes{{
    {"rest", 0.9, 0.28, {{{"jawOpen", 0.02}, {"mouthPress", 0.04}}}},
    {"open",
     1.0,
     0.10,
     {{{"jawOpen", 0.50}, {"mouthLowerDown", 0.22}, {"mouthUpperUp", 0.10}, {"mouthStretch", 0.04}}}},
    {"wide",
     1.0,
     0.10,
     {{{"jawOpen", 0.36},
       {"mouthStretch", 0.20},
       {"mouthLowerDown", 0.30},
       {"mouthUpperUp", 0.16},
       {"mouthSmile", 0.06}}}},
    {"mid", 0.7, 0.08, {{{"jawOpen", 0.24}, {"mouthLowerDown", 0.14}, {"mouthUpperUp", 0.05}}}},
    {"spread",
     0.9,
     0.09,
     {{{"jawOpen", 0.12},
       {"mouthStretch", 0.30},
       {"mouthSmile", 0.14},
       {"mouthLowerDown", 0.24},
       {"mouthUpperUp", 0.10}}}},
    {"round", 1.1, 0.10, {{{"jawOpen", 0.30}, {"mouthFunnel", 0.42}, {"mouthPucker", 0.22}, {"mouthLowerDown", 0.06}}}},
    {"pursed", 1.3, 0.10, {{{"jawOpen", 0.12}, {"mouthPucker", 0.68}, {"mouthFunnel", 0.22}}}},
    {"closed",
     2.6,
     0.075,
     {{{"jawOpen", 0.08},
       {"mouthClose", 0.09},
       {"mouthPress", 0.34},
       {"mouthRollLower", 0.22},
       {"mouthRollUpper", 0.16}}}},
    {"teeth",
     2.0,
     0.085,
     {{{"jawOpen", 0.08}, {"mouthRollLower", 0.42}, {"mouthUpperUp", 0.18}, {"mouthShrugLower", 0.08}}}},
    {"tongue", 0.6, 0.065, {{{"jawOpen", 0.14}, {"mouthLowerDown", 0.15}, {"mouthStretch", 0.06}}}},
    {"hiss",
     1.2,
     0.09,
     {{{"jawOpen", 0.05}, {"mouthStretch", 0.18}, {"mouthLowerDown", 0.26}, {"mouthUpperUp", 0.12}}}},
    {"hush", 1.5, 0.09, {{{"jawOpen", 0.10}, {"mouthFunnel", 0.55}, {"mouthPucker", 0.18}, {"mouthUpperUp", 0.08}}}},
    {"between", 1.0, 0.07, {{{"jawOpen", 0.13}, {"mouthLowerDown", 0.18}, {"mouthStretch", 0.05}}}},
    {"back", 0.5, 0.065, {{{"jawOpen", 0.20}, {"mouthLowerDown", 0.10}}}},
    {"arr", 1.1, 0.08, {{{"jawOpen", 0.15}, {"mouthFunnel", 0.32}, {"mouthPucker", 0.22}}}},
    {"half",
     0.9,
     0.09,
     {{{"jawOpen", 0.30}, {"mouthStretch", 0.14}, {"mouthLowerDown", 0.24}, {"mouthUpperUp", 0.10}}}},
    {"short", 0.8, 0.08, {{{"jawOpen", 0.20}, {"mouthPucker", 0.34}, {"mouthFunnel", 0.20}}}},
}};

struct Phone {
  std::string_view name, first, then;  // `then`: the second half of a diphthong
};

constexpr std::array<Phone, 39> kPhones{{
    {"_", "rest", ""},         {"AA", "open", ""},       {"AE", "wide", ""},       {"AH", "mid", ""},
    {"AO", "round", ""},       {"AW", "open", "pursed"}, {"AY", "open", "spread"}, {"EH", "half", ""},
    {"ER", "arr", ""},         {"EY", "half", "spread"}, {"IH", "spread", ""},     {"IY", "spread", ""},
    {"OW", "round", "pursed"}, {"UH", "short", ""},      {"UW", "pursed", ""},     {"B", "closed", ""},
    {"P", "closed", ""},       {"M", "closed", ""},      {"F", "teeth", ""},       {"V", "teeth", ""},
    {"T", "tongue", ""},       {"D", "tongue", ""},      {"N", "tongue", ""},      {"L", "tongue", ""},
    {"S", "hiss", ""},         {"Z", "hiss", ""},        {"SH", "hush", ""},       {"CH", "hush", ""},
    {"JH", "hush", ""},        {"ZH", "hush", ""},       {"TH", "between", ""},    {"DH", "between", ""},
    {"K", "back", ""},         {"G", "back", ""},        {"HH", "back", ""},       {"NG", "back", ""},
    {"Y", "spread", ""},       {"R", "arr", ""},         {"W", "pursed", ""},
}};

const Viseme& visemeOf(std::string_view name) {
  const auto found = std::find_if(kVisemes.begin(), kVisemes.end(), [&](const Viseme& v) { return v.name == name; });
  if (found == kVisemes.end()) throw std::invalid_argument("no viseme " + std::string(name));
  return *found;
}

}  // namespace

Speech::Speech(double start_s, std::string_view phones, Random& random) : start_s_(start_s), end_s_(start_s) {
  addGesture("rest", start_s - 0.12, 0.2, 1.0);
  double t_s = start_s;
  while (!phones.empty()) {
    std::string_view word = phones.substr(0, phones.find(' '));
    phones.remove_prefix(std::min(phones.size(), word.size() + 1));
    if (word.empty()) continue;
    const bool vowel = word.back() >= '0' && word.back() <= '9';
    const bool stressed = word.back() == '1';
    if (vowel) word.remove_suffix(1);
    const auto phone = std::find_if(kPhones.begin(), kPhones.end(), [&](const Phone& p) { return p.name == word; });
    if (phone == kPhones.end()) throw std::invalid_argument("no phone " + std::string(word));
    const double loudness = stressed ? random.between(1.05, 1.35) : random.between(0.7, 1.0);
    const double duration = visemeOf(phone->first).duration_s * (stressed ? 1.55 : 1.0) * random.between(0.88, 1.14);
    if (phone->then.empty()) {
      addGesture(phone->first, t_s + 0.5 * duration, duration, loudness);
      t_s += duration;
    } else {
      addGesture(phone->first, t_s + 0.35 * duration, 0.8 * duration, loudness);
      addGesture(phone->then, t_s + 1.05 * duration, 0.7 * duration, 0.85 * loudness);
      t_s += 1.4 * duration;
    }
    if (stressed) stresses_.push_back(t_s - 0.5 * duration);
  }
  addGesture("rest", t_s + 0.15, 0.3, 1.0);
  end_s_ = t_s;
}

void Speech::addGesture(std::string_view viseme, double centre_s, double duration_s, double loudness) {
  const Viseme& v = visemeOf(viseme);
  Gesture gesture{centre_s, 0.62 * duration_s, v.strength, {}};
  for (const ShapeWeight& entry : v.shapes) {
    if (entry.shape.empty()) continue;
    // Loud speech opens the jaw; what closes the lips closes them whatever the loudness.
    const double weight = entry.weight * (viseme == "closed" || viseme == "teeth" ? 1.0 : loudness);
    if (const auto whole = arkitBlendshapeIndex(entry.shape)) {
      gesture.targets.push_back({*whole, weight});
      continue;
    }
    for (const char* side : {"Left", "Right"}) {
      gesture.targets.push_back({arkitBlendshapeIndex(std::string(entry.shape) + side).value(), weight});
    }
  }
  gestures_.push_back(std::move(gesture));
}

void Speech::addTo(double t_s, ArkitWeights& weights) const {
  if (t_s < start_s_ - 0.4 || t_s > end_s_ + 0.6) return;
  std::array<double, kArkitBlendshapeCount> pulled{};
  double total = 1e-6;
  for (const Gesture& gesture : gestures_) {
    const double dominance =
        gesture.strength * std::exp(-std::pow(std::abs(t_s - gesture.centre_s) / gesture.reach_s, 1.6));
    total += dominance;
    for (const Target& target : gesture.targets) pulled[target.shape] += dominance * target.weight;
  }
  // Before the first and after the last phone the mouth is given back to the rest of the face.
  const double speaking = minimumJerk((t_s - start_s_ + 0.2) / 0.2) * (1.0 - minimumJerk((t_s - end_s_) / 0.35));
  for (std::size_t k = 0; k < pulled.size(); ++k) weights[k] += static_cast<float>(speaking * pulled[k] / total);
}

}  // namespace volto::recordings
