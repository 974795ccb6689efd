// The choreography of the shipped take: what the face and the head do at each moment. Everything is a function of time
// and of one seed; nothing is taken from a recording of a person.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>
#include <vector>

#include "frames/arkit_blendshapes.h"
#include "recordings/make/motion.h"
#include "recordings/make/speech.h"

namespace volto::recordings {

struct Moment {
  ArkitWeights weights{};
  // Of the head, relative to looking straight into the camera, right-handed about the head's own axes: yaw > 0 to the
  // subject's left, pitch > 0 down, roll > 0 towards the subject's right shoulder. Rotation = R_y(yaw) R_x(pitch)
  // R_z(roll).
  double yaw_rad = 0, pitch_rad = 0, roll_rad = 0;
  std::array<double, 3> head_mm{0, 0, 0};  // camera frame
  bool face_present = true;
  double confidence = 0.97;
};

class Performance {
 public:
  explicit Performance(std::uint64_t seed);
  double durationS() const { return 36.0; }
  Moment at(double t_s) const;

 private:
  struct Blink {
    double start_s, closing_s, closed_s, opening_s, depth;
    double at(double t_s) const;
  };
  // Shapes that rise and fall together; a name without side ("mouthSmile") moves both.
  struct Episode {
    Swell swell;
    std::vector<std::pair<std::size_t, double>> shapes;
  };
  struct Glance {
    double t_s, yaw_rad, pitch_rad;  // where the eyes go at t_s
  };

  void addEpisode(const Swell& swell, std::initializer_list<std::pair<std::string_view, double>> shapes);
  void scheduleBlinks(Random& random);
  void scheduleGlances(Random& random);
  void addEyes(double t_s, ArkitWeights& weights) const;
  void addHead(double t_s, Moment& moment) const;

  std::vector<Speech> sentences_;
  std::vector<Episode> episodes_;
  std::vector<Blink> blinks_;
  std::vector<Glance> glances_;
  std::vector<Wander> wander_;
  std::vector<std::pair<double, double>> accents_;  // time and strength of a raised brow and a small nod while speaking
  Keys yaw_, pitch_, roll_, lean_;
};

}  // namespace volto::recordings
