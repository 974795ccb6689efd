#include "rig/fitting/human_face.h"

#include <array>

namespace volto::rig {
namespace {

struct HalfPoint {
  std::string_view id;
  double x, y, z, spread;
};

// clang-format off
constexpr std::array kHalf = {
    HalfPoint{"2.1", 0.000, -1.762, 0.144, 0.030},
    HalfPoint{"2.2", 0.000, -1.102, 0.334, 0.026},
    HalfPoint{"2.3", 0.000, -1.136, 0.323, 0.026},
    HalfPoint{"2.4", 0.347, -1.136, 0.173, 0.025},
    HalfPoint{"2.6", 0.149, -1.092, 0.312, 0.034},
    HalfPoint{"2.8", 0.178, -1.131, 0.292, 0.015},
    HalfPoint{"2.10", 0.000, -1.565, 0.256, 0.029},
    HalfPoint{"2.11", 0.231, -1.735, 0.128, 0.032},
    HalfPoint{"2.13", 0.875, -1.340, -0.458, 0.152},
    HalfPoint{"3.1", 0.518, 0.095, 0.094, 0.032},
    HalfPoint{"3.3", 0.517, -0.057, 0.065, 0.032},
    HalfPoint{"3.7", 0.703, 0.016, -0.034, 0.020},
    HalfPoint{"3.9", 0.505, -0.177, 0.059, 0.039},
    HalfPoint{"3.11", 0.297, -0.016, 0.034, 0.033},
    HalfPoint{"3.13", 0.508, 0.159, 0.118, 0.040},
    HalfPoint{"4.1", 0.150, 0.364, 0.265, 0.051},
    HalfPoint{"4.3", 0.645, 0.452, 0.095, 0.050},
    HalfPoint{"4.5", 0.919, 0.230, -0.196, 0.050},
    HalfPoint{"5.1", 0.610, -0.587, 0.093, 0.034},
    HalfPoint{"5.3", 0.704, -0.220, 0.004, 0.015},
    HalfPoint{"8.1", 0.000, -0.963, 0.427, 0.039},
    HalfPoint{"8.2", 0.000, -1.289, 0.354, 0.025},
    HalfPoint{"8.3", 0.402, -1.149, 0.184, 0.030},
    HalfPoint{"8.5", 0.270, -0.995, 0.326, 0.041},
    HalfPoint{"8.7", 0.288, -1.250, 0.263, 0.035},
    HalfPoint{"8.10", 0.100, -0.954, 0.411, 0.043},
    HalfPoint{"9.1", 0.203, -0.737, 0.280, 0.064},
    HalfPoint{"9.3", 0.000, -0.536, 0.604, 0.020},
    HalfPoint{"9.5", 0.091, -0.755, 0.354, 0.056},
    HalfPoint{"9.7", 0.128, 0.040, 0.157, 0.056},
    HalfPoint{"9.12", 0.000, -0.331, 0.506, 0.015},
    HalfPoint{"9.13", 0.112, -0.452, 0.420, 0.105},
    HalfPoint{"9.15", 0.000, -0.771, 0.373, 0.054},
    HalfPoint{"10.7", 1.153, -0.362, -0.807, 0.060},
    HalfPoint{"10.9", 1.157, 0.003, -0.828, 0.033},
    HalfPoint{"11.1", 0.000, 1.095, 0.013, 0.080},
    HalfPoint{"11.3", 0.639, 0.935, -0.118, 0.030},
    HalfPoint{"12.1", 0.394, 0.436, 0.226, 0.016},
    HalfPoint{"12.2", 0.790, 0.398, -0.023, 0.024},
    HalfPoint{"12.5", 0.440, 0.085, 0.082, 0.027},
    HalfPoint{"12.6", 0.615, 0.079, 0.068, 0.015},
    HalfPoint{"12.7", 0.438, -0.047, 0.059, 0.034},
    HalfPoint{"12.8", 0.611, -0.043, 0.042, 0.019},
    HalfPoint{"12.13", 0.000, 0.077, 0.242, 0.054},
    HalfPoint{"12.14", 0.000, -0.149, 0.365, 0.015},
    HalfPoint{"12.15", 0.139, -1.279, 0.339, 0.031},
    HalfPoint{"12.17", 0.472, -1.702, -0.112, 0.078},
    HalfPoint{"12.19", 1.028, -0.932, -0.487, 0.165},
};
// clang-format on

}  // namespace

const HumanFace& humanFace() {
  static const HumanFace face = [] {
    HumanFace out;
    out.points.setZero();
    for (const HalfPoint& p : kHalf) {
      const std::size_t i = featurePointIndex(p.id).value();
      const std::size_t mirror = featurePoints()[i].mirror;
      out.points.row(static_cast<Eigen::Index>(i)) << p.x, p.y, p.z;
      if (mirror != i) out.points.row(static_cast<Eigen::Index>(mirror)) << -p.x, p.y, p.z;
      out.spread[i] = out.spread[mirror] = p.spread;
    }
    return out;
  }();
  return face;
}

}  // namespace volto::rig
