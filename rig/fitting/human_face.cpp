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
    HalfPoint{"2.1", 0.000, -1.761, 0.148, 0.030},
    HalfPoint{"2.2", 0.000, -1.104, 0.336, 0.026},
    HalfPoint{"2.3", 0.000, -1.138, 0.336, 0.026},
    HalfPoint{"2.4", 0.341, -1.134, 0.167, 0.025},
    HalfPoint{"2.6", 0.141, -1.096, 0.312, 0.034},
    HalfPoint{"2.8", 0.178, -1.133, 0.299, 0.015},
    HalfPoint{"2.10", 0.000, -1.576, 0.259, 0.029},
    HalfPoint{"2.11", 0.225, -1.735, 0.139, 0.032},
    HalfPoint{"2.13", 0.828, -1.421, -0.526, 0.152},
    HalfPoint{"3.1", 0.513, 0.088, 0.094, 0.032},
    HalfPoint{"3.3", 0.515, -0.050, 0.065, 0.032},
    HalfPoint{"3.7", 0.702, 0.015, -0.030, 0.020},
    HalfPoint{"3.9", 0.502, -0.174, 0.061, 0.039},
    HalfPoint{"3.11", 0.298, -0.015, 0.030, 0.033},
    HalfPoint{"3.13", 0.507, 0.154, 0.117, 0.040},
    HalfPoint{"4.1", 0.150, 0.370, 0.267, 0.051},
    HalfPoint{"4.3", 0.644, 0.451, 0.099, 0.050},
    HalfPoint{"4.5", 0.918, 0.228, -0.196, 0.050},
    HalfPoint{"5.1", 0.601, -0.583, 0.102, 0.034},
    HalfPoint{"5.3", 0.697, -0.216, 0.013, 0.015},
    HalfPoint{"8.1", 0.000, -0.964, 0.431, 0.039},
    HalfPoint{"8.2", 0.000, -1.286, 0.368, 0.025},
    HalfPoint{"8.3", 0.401, -1.149, 0.188, 0.030},
    HalfPoint{"8.5", 0.270, -0.994, 0.327, 0.041},
    HalfPoint{"8.7", 0.285, -1.250, 0.269, 0.035},
    HalfPoint{"8.10", 0.101, -0.952, 0.414, 0.043},
    HalfPoint{"9.1", 0.197, -0.728, 0.290, 0.064},
    HalfPoint{"9.3", 0.000, -0.537, 0.607, 0.020},
    HalfPoint{"9.5", 0.088, -0.754, 0.360, 0.056},
    HalfPoint{"9.7", 0.130, 0.046, 0.157, 0.056},
    HalfPoint{"9.12", 0.000, -0.330, 0.509, 0.015},
    HalfPoint{"9.13", 0.049, -0.498, 0.396, 0.105},
    HalfPoint{"9.15", 0.000, -0.763, 0.371, 0.054},
    HalfPoint{"10.7", 1.152, -0.363, -0.803, 0.060},
    HalfPoint{"10.9", 1.159, -0.002, -0.832, 0.033},
    HalfPoint{"11.1", 0.000, 1.095, 0.017, 0.080},
    HalfPoint{"11.3", 0.634, 0.938, -0.109, 0.030},
    HalfPoint{"12.1", 0.394, 0.440, 0.230, 0.016},
    HalfPoint{"12.2", 0.791, 0.396, -0.021, 0.024},
    HalfPoint{"12.5", 0.434, 0.080, 0.082, 0.027},
    HalfPoint{"12.6", 0.611, 0.074, 0.061, 0.015},
    HalfPoint{"12.7", 0.436, -0.039, 0.061, 0.034},
    HalfPoint{"12.8", 0.605, -0.043, 0.047, 0.019},
    HalfPoint{"12.13", 0.000, 0.084, 0.248, 0.054},
    HalfPoint{"12.14", 0.000, -0.148, 0.366, 0.015},
    HalfPoint{"12.15", 0.136, -1.277, 0.346, 0.031},
    HalfPoint{"12.17", 0.458, -1.733, -0.124, 0.078},
    HalfPoint{"12.19", 1.039, -0.939, -0.464, 0.165},
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
