// What the mesh readers have in common: polygons from indices that came from outside, notes, colours.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "rig/mesh.h"
#include "rig/mesh_limits.h"

namespace volto::rig {

// At most kMaxNotes lines, then one that says how many more there were.
class Notes {
 public:
  void add(std::string line) {
    if (lines_.size() < kMaxNotes) lines_.push_back(std::move(line));
    ++count_;
  }
  std::vector<std::string> take() {
    if (count_ > lines_.size()) lines_.push_back("and " + std::to_string(count_ - lines_.size()) + " more");
    return std::move(lines_);
  }

 private:
  std::vector<std::string> lines_;
  std::size_t count_ = 0;
};

// Colours of points and materials are linear in a Mesh; OBJ and PLY files hold them as a screen shows them.
inline float linearFromDisplay(float x) {
  x = std::clamp(x, 0.0F, 1.0F);
  return x <= 0.04045F ? x / 12.92F : std::pow((x + 0.055F) / 1.055F, 2.4F);
}
inline float displayFromLinear(float x) {
  x = std::clamp(x, 0.0F, 1.0F);
  return x <= 0.0031308F ? x * 12.92F : 1.055F * std::pow(x, 1.0F / 2.4F) - 0.055F;
}

}  // namespace volto::rig
