#include "rig/fitting/human_face.h"

#include <algorithm>
#include <array>

namespace volto::rig {
namespace {

struct HalfPoint {
  std::string_view id;
  double x, y, z, spread;
  double spread_unseen = 0;  // where it is larger
};

// clang-format off
constexpr std::array kHalf = {
    HalfPoint{"2.1", 0.000, -1.765, 0.152, 0.030},
    HalfPoint{"2.2", 0.000, -1.107, 0.339, 0.026},
    HalfPoint{"2.3", 0.000, -1.143, 0.348, 0.026},
    HalfPoint{"2.4", 0.341, -1.139, 0.166, 0.025},
    HalfPoint{"2.6", 0.143, -1.099, 0.318, 0.034},
    HalfPoint{"2.8", 0.175, -1.137, 0.306, 0.015},
    HalfPoint{"2.10", 0.000, -1.583, 0.263, 0.029},
    HalfPoint{"2.11", 0.225, -1.744, 0.142, 0.032},
    HalfPoint{"2.13", 0.858, -1.390, -0.452, 0.152},
    HalfPoint{"3.1", 0.511, 0.082, 0.095, 0.032},
    HalfPoint{"3.3", 0.519, -0.046, 0.065, 0.032},
    HalfPoint{"3.7", 0.704, 0.015, -0.028, 0.020},
    HalfPoint{"3.9", 0.502, -0.173, 0.063, 0.039},
    HalfPoint{"3.11", 0.296, -0.015, 0.028, 0.033},
    HalfPoint{"3.13", 0.505, 0.152, 0.115, 0.040},
    HalfPoint{"4.1", 0.148, 0.375, 0.269, 0.051},
    HalfPoint{"4.3", 0.646, 0.451, 0.103, 0.050, 0.146},
    HalfPoint{"4.5", 0.918, 0.228, -0.196, 0.050, 0.122},
    HalfPoint{"5.1", 0.600, -0.583, 0.107, 0.034},
    HalfPoint{"5.3", 0.697, -0.215, 0.018, 0.015},
    HalfPoint{"8.1", 0.000, -0.967, 0.435, 0.039},
    HalfPoint{"8.2", 0.000, -1.288, 0.378, 0.025},
    HalfPoint{"8.3", 0.401, -1.151, 0.192, 0.030},
    HalfPoint{"8.5", 0.269, -0.997, 0.330, 0.041},
    HalfPoint{"8.7", 0.284, -1.252, 0.273, 0.035},
    HalfPoint{"8.10", 0.100, -0.956, 0.418, 0.043},
    HalfPoint{"9.1", 0.200, -0.736, 0.296, 0.064},
    HalfPoint{"9.3", 0.000, -0.539, 0.611, 0.020},
    HalfPoint{"9.5", 0.088, -0.755, 0.366, 0.056},
    HalfPoint{"9.7", 0.131, 0.048, 0.158, 0.056},
    HalfPoint{"9.12", 0.000, -0.330, 0.514, 0.015},
    HalfPoint{"9.13", 0.112, -0.453, 0.422, 0.105},
    HalfPoint{"9.15", 0.000, -0.762, 0.370, 0.054},
    HalfPoint{"10.7", 1.154, -0.365, -0.801, 0.060},
    HalfPoint{"10.9", 1.162, -0.004, -0.829, 0.033},
    HalfPoint{"11.1", 0.000, 1.098, 0.019, 0.080},
    HalfPoint{"11.3", 0.635, 0.942, -0.104, 0.030},
    HalfPoint{"12.1", 0.395, 0.443, 0.234, 0.016},
    HalfPoint{"12.2", 0.792, 0.398, -0.018, 0.024, 0.070},
    HalfPoint{"12.5", 0.431, 0.077, 0.083, 0.027},
    HalfPoint{"12.6", 0.609, 0.073, 0.062, 0.015},
    HalfPoint{"12.7", 0.439, -0.035, 0.064, 0.034},
    HalfPoint{"12.8", 0.602, -0.041, 0.049, 0.019},
    HalfPoint{"12.13", 0.000, 0.088, 0.254, 0.054},
    HalfPoint{"12.14", 0.000, -0.148, 0.370, 0.015},
    HalfPoint{"12.15", 0.135, -1.278, 0.352, 0.031},
    HalfPoint{"12.17", 0.470, -1.712, -0.100, 0.078},
    HalfPoint{"12.19", 1.035, -0.950, -0.455, 0.165},
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
      out.spread_unseen[i] = out.spread_unseen[mirror] = std::max(p.spread, p.spread_unseen);
    }
    return out;
  }();
  return face;
}

}  // namespace volto::rig
