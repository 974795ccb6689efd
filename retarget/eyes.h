// Eyeballs: rigid parts that turn about their own centre with the gaze.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "frames/mask_frame.h"
#include "retarget/deformer.h"
#include "rig/rig.h"

namespace volto::retarget {

// Rotation, head frame, of an eye that looks `gaze`: R * (0, 0, 1) = (sin yaw cos pitch, sin pitch, cos yaw cos pitch),
// so that yaw > 0 looks to the subject's left and pitch > 0 up. Row by row. Angles that are not finite count as 0,
// others are held within a quarter turn.
std::array<std::array<double, 3>, 3> headFromEye(const Gaze::Eye& gaze);

// Thread-safe after construction. Borrows nothing.
class Eyes {
 public:
  explicit Eyes(const rig::Rig& rig);

  bool empty() const { return turns_.empty(); }

  // Turns the vertices of every part that follows an eye, on top of the displacement they already have: out += (R -
  // 1)(neutral - centre), R in the mesh frame. Straight ahead changes nothing, to the bit. A gaze without confidence is
  // straight ahead.
  void turn(const Gaze& gaze, std::span<Vertex> out) const;

 private:
  struct Turn {
    bool left;
    std::vector<std::uint32_t> vertices;
    std::vector<Vertex> from_centre;  // neutral - centre, mesh frame
  };
  std::vector<Turn> turns_;
  std::array<std::array<double, 3>, 3> mesh_from_head_;
};

}  // namespace volto::retarget
