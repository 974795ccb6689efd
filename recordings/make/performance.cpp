#include "recordings/make/performance.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

namespace volto::recordings {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

// "Hello! This is Volto. It follows a face, and moves a mask."
constexpr std::string_view kFirst =
    "HH AH0 L OW1 _ DH IH0 S IH0 Z V OW1 L T OW0 _ IH0 T F AA1 L OW0 Z AH0 F EY1 S _ AE0 N D M UW1 V Z AH0 M AE1 S K _";
// "Watch my brows, my lips, and the way my eyes open. Whenever I speak, you can see it."
constexpr std::string_view kSecond =
    "W AA1 CH M AY0 B R AW1 Z _ M AY0 L IH1 P S _ AE0 N D DH AH0 W EY1 M AY0 AY1 Z OW1 P AH0 N _ W EH0 N EH1 V ER0 AY0 "
    "S P IY1 K _ "
    "Y UW0 K AE0 N S IY1 IH0 T _";
// "Oh, that was good! Maybe we should try it once more: peas, boots, and a chair."
constexpr std::string_view kThird =
    "OW1 _ DH AE1 T W AH0 Z G UH1 D _ M EY1 B IY0 W IY0 SH UH0 D T R AY1 IH0 T W AH1 N S M AO1 R _ P IY1 Z _ B UW1 T S "
    "_ AE0 N D AH0 "
    "CH EH1 R _";

// Somebody passes a hand before the face.
constexpr double kHandFrom = 21.72, kLostFrom = 21.90, kLostTo = 22.25, kHandTo = 22.40;

std::size_t shapeIndex(const std::string& name) {
  const auto index = arkitBlendshapeIndex(name);
  if (!index) throw std::logic_error("no shape " + name);
  return *index;
}

// A burst of laughter: the jaw and the head shake together, less and less.
double laughter(double t_s) {
  constexpr double kFrom = 16.5, kTo = 18.1;
  if (t_s < kFrom || t_s > kTo) return 0.0;
  const double since = t_s - kFrom;
  return Swell{kFrom, 0.15, 0.6, 0.8}.at(t_s) * (0.5 - 0.5 * std::cos(2.0 * std::numbers::pi * 4.6 * since)) *
         std::exp(-0.9 * since);
}

}  // namespace

Performance::Performance(std::uint64_t seed)
    : yaw_({{0, 0, 1},
            {2.6, 5, 0.7},
            {4.4, -4, 0.8},
            {6.2, 2, 0.9},
            {9.9, -19, 1.1},
            {12.1, -12, 0.8},
            {13.6, 3, 1.0},
            {15.2, 0, 0.3},
            {17.2, 7, 0.7},
            {18.8, -2, 0.9},
            {20.0, -6, 0.8},
            {21.5, 0, 0.8},
            {24.6, 21, 1.2},
            {26.4, 12, 0.8},
            {27.9, -5, 1.0},
            {29.6, -9, 0.6},
            {31.0, 0, 0.7},
            {33.0, 4, 0.8},
            {35.2, 0, 1.0}}),
      pitch_({{0, 0, 1},        {2.0, 3, 0.6},    {3.8, -3, 0.7},  {6.4, 4, 0.8},   {8.4, 0, 0.6},   {10.4, 5, 0.9},
              {12.8, -4, 0.9},  {14.6, 0, 0.7},   {15.3, 9, 0.28}, {16.4, 2, 0.6},  {17.6, -5, 0.6}, {18.9, 0, 0.8},
              {19.8, -11, 0.7}, {21.4, 0, 0.8},   {24.0, 4, 0.8},  {26.0, -5, 0.8}, {28.4, 1, 0.9},  {29.6, -4, 0.5},
              {31.0, 0, 0.6},   {33.25, -7, 0.3}, {33.6, 2, 0.32}, {34.0, -6, 0.3}, {34.4, 0, 0.4}}),
      roll_({{0, 0, 1},
             {3.0, 3, 0.9},
             {6.0, -4, 0.9},
             {8.6, 0, 0.8},
             {10.6, 5, 1.0},
             {13.4, -3, 1.0},
             {15.2, 0, 0.4},
             {17.0, -6, 0.7},
             {19.2, 0, 0.9},
             {24.8, -5, 1.2},
             {27.4, 3, 1.0},
             {29.6, 8, 0.5},
             {31.0, 0, 0.7},
             {33.4, -4, 0.8},
             {35.2, 0, 1.0}}),
      lean_({{0, 0, 1},
             {4.0, -18, 1.5},
             {8.0, 5, 1.5},
             {15.25, 32, 0.35},
             {16.6, 0, 0.9},
             {19.9, -28, 0.8},
             {21.6, 0, 1.0},
             {27.0, -15, 1.5},
             {30.0, 6, 1.0},
             {35.0, 0, 1.5}}) {
  Random random(seed);
  for (int i = 0; i < 6; ++i) wander_.emplace_back(random, 0.12, 1.1);   // head: angles, position
  for (int i = 0; i < 10; ++i) wander_.emplace_back(random, 0.15, 1.6);  // face at rest
  sentences_.emplace_back(1.5, kFirst, random);
  sentences_.emplace_back(8.3, kSecond, random);
  sentences_.emplace_back(22.8, kThird, random);
  for (const Speech& sentence : sentences_) {
    for (const double t_s : sentence.stresses())
      accents_.emplace_back(t_s, random.unit() < 0.45 ? random.between(0.4, 1.0) : 0.15);
  }

  addEpisode({5.9, 0.55, 1.0, 0.9},
             {{"mouthSmile", 0.62}, {"cheekSquint", 0.32}, {"eyeSquint", 0.22}, {"mouthDimple", 0.18}});
  addEpisode({9.0, 0.25, 0.6, 0.5}, {{"browInnerUp", 0.55}, {"browOuterUp", 0.62}});
  addEpisode({11.2, 0.22, 0.7, 0.5}, {{"eyeWide", 0.55}, {"browInnerUp", 0.35}, {"browOuterUp", 0.40}});
  addEpisode({12.4, 0.8, 1.6, 0.8}, {{"mouthSmile", 0.25}, {"mouthDimple", 0.1}});
  addEpisode(
      {15.0, 0.16, 0.55, 0.45},
      {{"browInnerUp", 0.90}, {"browOuterUp", 0.85}, {"eyeWide", 0.85}, {"jawOpen", 0.55}, {"mouthFunnel", 0.22}});
  addEpisode({16.1, 0.35, 1.5, 0.9}, {{"mouthSmile", 0.85},
                                      {"cheekSquint", 0.60},
                                      {"eyeSquint", 0.45},
                                      {"jawOpen", 0.16},
                                      {"mouthUpperUp", 0.28},
                                      {"mouthLowerDown", 0.14},
                                      {"noseSneer", 0.12}});
  addEpisode({19.2, 0.45, 0.95, 0.6}, {{"browDown", 0.82},
                                       {"mouthFrown", 0.55},
                                       {"mouthPress", 0.35},
                                       {"noseSneer", 0.38},
                                       {"eyeSquint", 0.35},
                                       {"mouthShrugLower", 0.42}});
  addEpisode({26.2, 0.3, 0.8, 0.6}, {{"browInnerUp", 0.50}, {"browOuterUpLeft", 0.35}});
  addEpisode({29.2, 0.32, 0.85, 0.5}, {{"mouthLeft", 0.55},
                                       {"mouthPucker", 0.30},
                                       {"browOuterUpLeft", 0.75},
                                       {"browDownRight", 0.50},
                                       {"eyeSquintRight", 0.40},
                                       {"mouthPress", 0.12}});
  addEpisode({31.1, 0.25, 0.15, 0.3}, {{"jawLeft", 0.50}, {"jawOpen", 0.10}});
  addEpisode({31.6, 0.25, 0.15, 0.3}, {{"jawRight", 0.50}, {"jawOpen", 0.12}});
  addEpisode({32.7, 0.6, 1.3, 0.8}, {{"mouthSmile", 0.78},
                                     {"cheekSquint", 0.48},
                                     {"eyeSquint", 0.35},
                                     {"mouthUpperUp", 0.22},
                                     {"mouthStretch", 0.12},
                                     {"browInnerUp", 0.18}});
  scheduleBlinks(random);
  scheduleGlances(random);
}

void Performance::addEpisode(const Swell& swell, std::initializer_list<std::pair<std::string_view, double>> shapes) {
  Episode episode{swell, {}};
  for (const auto& [name, weight] : shapes) {
    if (const auto whole = arkitBlendshapeIndex(name)) {
      episode.shapes.emplace_back(*whole, weight);
      continue;
    }
    // Nobody is quite symmetric.
    episode.shapes.emplace_back(shapeIndex(std::string(name) + "Left"), 1.05 * weight);
    episode.shapes.emplace_back(shapeIndex(std::string(name) + "Right"), 0.93 * weight);
  }
  episodes_.push_back(std::move(episode));
}

double Performance::Blink::at(double t_s) const {
  const double since = t_s - start_s;
  return depth * minimumJerk(since / closing_s) * (1.0 - minimumJerk((since - closing_s - closed_s) / opening_s));
}

void Performance::scheduleBlinks(Random& random) {
  const auto add = [&](double start_s, double depth) {
    blinks_.push_back(
        {start_s, random.between(0.08, 0.13), random.between(0.02, 0.05), random.between(0.17, 0.24), depth});
  };
  for (double t_s = 0.75; t_s < durationS() - 0.6; t_s += random.between(1.9, 4.8)) {
    const bool staring = (t_s > 14.9 && t_s < 16.1) || (t_s > 11.1 && t_s < 12.3);  // wide eyes do not blink
    if (!staring) add(t_s, random.between(0.9, 1.0));
    if (random.unit() < 0.15) add(t_s + 0.42, random.between(0.75, 0.95));  // now and then twice
  }
  // With the large turns of the head, as people do.
  for (const double t_s : {9.05, 16.3, 23.65, 27.1}) add(t_s, 0.92);
}

void Performance::scheduleGlances(Random& random) {
  glances_.push_back({0.0, 0.0, 0.0});
  for (double t_s = 0.9; t_s < durationS() - 1.2; t_s += random.between(0.5, 2.2)) {
    const bool away = random.unit() < 0.55;  // else back to the camera
    glances_.push_back({t_s, away ? random.between(-0.30, 0.30) : random.between(-0.03, 0.03),
                        away ? random.between(-0.22, 0.12) : random.between(-0.02, 0.02)});
  }
  glances_.push_back({durationS() - 1.0, 0.0, 0.0});
}

void Performance::addEyes(double t_s, ArkitWeights& weights) const {
  const auto set = [&](const char* name, double value) {
    weights[shapeIndex(name)] += static_cast<float>(std::max(0.0, value));
  };
  double yaw = 0.0, pitch = 0.0;
  for (std::size_t i = 1; i < glances_.size(); ++i) {
    const double gone = minimumJerk((t_s - glances_[i].t_s) / 0.05);  // a saccade
    yaw += gone * (glances_[i].yaw_rad - glances_[i - 1].yaw_rad);
    pitch += gone * (glances_[i].pitch_rad - glances_[i - 1].pitch_rad);
  }
  constexpr double kWeightPerRadian = 1.8;
  yaw *= kWeightPerRadian;
  pitch *= kWeightPerRadian;
  set("eyeLookOutLeft", yaw);
  set("eyeLookInRight", yaw);
  set("eyeLookInLeft", -yaw);
  set("eyeLookOutRight", -yaw);
  for (const char* side : {"Left", "Right"}) {
    set((std::string("eyeLookUp") + side).c_str(), pitch);
    set((std::string("eyeLookDown") + side).c_str(), -pitch);
  }
  double closed = 0.0;
  for (const Blink& blink : blinks_) closed = std::max(closed, blink.at(t_s));
  // A blink closes what is open: wide eyes and a squint give way to it.
  for (const char* name : {"eyeWideLeft", "eyeWideRight", "eyeSquintLeft", "eyeSquintRight"}) {
    weights[shapeIndex(name)] *= static_cast<float>(1.0 - 0.8 * closed);
  }
  set("eyeBlinkLeft", closed + 0.03);
  set("eyeBlinkRight", 0.98 * closed + 0.04);
}

void Performance::addHead(double t_s, Moment& moment) const {
  double nod = 0.0;
  for (const auto& [accent_s, strength] : accents_)
    nod -= 2.4 * strength * Swell{accent_s - 0.12, 0.16, 0.03, 0.3}.at(t_s);
  moment.yaw_rad = kDegree * (yaw_.at(t_s) + 0.9 * wander_[0].at(t_s));
  const double up_rad = kDegree * (pitch_.at(t_s) + nod + 0.7 * wander_[1].at(t_s) + 2.0 * laughter(t_s));
  moment.pitch_rad = -up_rad;
  moment.roll_rad = kDegree * (roll_.at(t_s) + 0.7 * wander_[2].at(t_s));
  // The head is carried by the neck: turning moves it sideways, nodding lowers it.
  moment.head_mm = {4.0 + 3.0 * wander_[3].at(t_s) + 55.0 * std::sin(moment.yaw_rad),
                    -38.0 + 2.0 * wander_[4].at(t_s) - 45.0 * std::sin(up_rad) + 3.0 * laughter(t_s),
                    560.0 + 4.0 * wander_[5].at(t_s) + lean_.at(t_s)};
}

Moment Performance::at(double t_s) const {
  Moment moment;
  ArkitWeights& weights = moment.weights;
  for (const Speech& sentence : sentences_) sentence.addTo(t_s, weights);
  // Rounded lips leave less room for a smile.
  const double rounded = std::min<double>(1.0, weights[shapeIndex("mouthPucker")] + weights[shapeIndex("mouthFunnel")]);
  for (const Episode& episode : episodes_) {
    // Nobody holds an expression like a statue.
    const double amount = episode.swell.at(t_s) * (1.0 + 0.06 * wander_[15].at(1.7 * t_s));
    if (amount <= 0.0) continue;
    for (const auto& [shape, weight] : episode.shapes) {
      const bool smile = kArkitBlendshapeNames[shape].starts_with("mouthSmile");
      weights[shape] += static_cast<float>(amount * weight * (smile ? 1.0 - 0.6 * rounded : 1.0));
    }
  }
  weights[shapeIndex("jawOpen")] += static_cast<float>(0.34 * laughter(t_s));

  double accent = 0.0;
  for (const auto& [accent_s, strength] : accents_) {
    if (strength > 0.3) accent = std::max(accent, strength * Swell{accent_s - 0.2, 0.2, 0.12, 0.4}.at(t_s));
  }
  const auto rest = [&](const char* name, double level, double swing, std::size_t which) {
    weights[shapeIndex(name)] += static_cast<float>(std::max(0.0, level + swing * wander_[6 + which].at(t_s)));
  };
  rest("browInnerUp", 0.03 + 0.30 * accent, 0.02, 0);
  rest("browOuterUpLeft", 0.02 + 0.26 * accent, 0.02, 1);
  rest("browOuterUpRight", 0.02 + 0.22 * accent, 0.02, 1);
  rest("browDownLeft", 0.02, 0.02, 2);
  rest("browDownRight", 0.03, 0.02, 2);
  rest("mouthSmileLeft", 0.06, 0.03, 3);
  rest("mouthSmileRight", 0.05, 0.03, 3);
  rest("eyeSquintLeft", 0.06, 0.03, 4);
  rest("eyeSquintRight", 0.07, 0.03, 4);
  rest("mouthPressLeft", 0.03, 0.02, 5);
  rest("mouthPressRight", 0.03, 0.02, 5);
  rest("jawOpen", 0.01, 0.006, 6);
  rest("jawForward", 0.01, 0.01, 7);
  rest("mouthShrugLower", 0.02, 0.015, 8);
  addEyes(t_s, weights);
  for (float& weight : weights) weight = std::clamp(weight, 0.0F, 1.0F);
  addHead(t_s, moment);

  moment.face_present = t_s < kLostFrom || t_s >= kLostTo;
  double covered = minimumJerk((t_s - kHandFrom) / (kLostFrom - kHandFrom)) *
                   (1.0 - minimumJerk((t_s - kLostTo) / (kHandTo - kLostTo)));
  // Quick turns blur the picture.
  for (const double blur_s : {9.2, 15.1, 23.9})
    covered = std::max(covered, 0.45 * Swell{blur_s, 0.12, 0.05, 0.2}.at(t_s));
  moment.confidence = (0.965 + 0.01 * wander_[15].at(t_s)) * (1.0 - 0.6 * covered);
  if (!moment.face_present) moment.confidence = 0.0;
  return moment;
}

}  // namespace volto::recordings
