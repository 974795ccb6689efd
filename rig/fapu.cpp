#include "rig/fapu.h"

#include <array>
#include <cmath>
#include <cstdio>
#include <stdexcept>
#include <string_view>

namespace volto::rig {
namespace {

Eigen::Index row(std::string_view id) { return static_cast<Eigen::Index>(featurePointIndex(id).value()); }

// Human proportions of the units, as fractions of the eye separation: of the reference mask, rounded.
struct HumanProportion {
  FapuUnit unit;
  std::string_view name;
  double of_eye_separation;
};
constexpr std::array<HumanProportion, 4> kHumanProportions = {{
    {FapuUnit::iris_diameter, "IRISD0 (lid to lid, 3.1-3.3 and 3.2-3.4)", 0.18},
    {FapuUnit::eye_nose, "ENS0 (eyes to 9.15)", 0.74},
    {FapuUnit::mouth_nose, "MNS0 (9.15 to 2.2)", 0.34},
    {FapuUnit::mouth_width, "MW0 (8.3 to 8.4)", 0.84},
}};
constexpr double kNearZero = 0.02;  // of the human proportion: below it a unit cannot carry a displacement

template <typename AnyFapu>  // Fapu or const Fapu
auto& unitOf(AnyFapu& fapu, FapuUnit unit) {
  switch (unit) {
    case FapuUnit::iris_diameter:
      return fapu.iris_diameter;
    case FapuUnit::eye_separation:
      return fapu.eye_separation;
    case FapuUnit::eye_nose:
      return fapu.eye_nose;
    case FapuUnit::mouth_nose:
      return fapu.mouth_nose;
    case FapuUnit::mouth_width:
      return fapu.mouth_width;
  }
  throw std::logic_error("unknown FAPU");
}

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", value);
  return text;
}

}  // namespace

double Fapu::operator[](FapuUnit unit) const { return unitOf(*this, unit); }

FapuMeasurement measureFapu(const FeaturePointPositions& neutral) {
  if (!neutral.allFinite()) throw std::invalid_argument("a feature point is not a finite position");
  const Eigen::RowVector3d left_eye = 0.5 * (neutral.row(row("3.7")) + neutral.row(row("3.11")));
  const Eigen::RowVector3d right_eye = 0.5 * (neutral.row(row("3.8")) + neutral.row(row("3.12")));
  const double eyes_y = 0.5 * (left_eye.y() + right_eye.y());

  FapuMeasurement measured;
  Fapu& fapu = measured.fapu;
  fapu.eye_separation = (left_eye - right_eye).norm();
  fapu.iris_diameter =
      0.5 * ((neutral(row("3.1"), 1) - neutral(row("3.3"), 1)) + (neutral(row("3.2"), 1) - neutral(row("3.4"), 1)));
  fapu.eye_nose = eyes_y - neutral(row("9.15"), 1);
  fapu.mouth_nose = neutral(row("9.15"), 1) - neutral(row("2.2"), 1);
  fapu.mouth_width = (neutral.row(row("8.3")) - neutral.row(row("8.4"))).norm();

  const double extent = (neutral.colwise().maxCoeff() - neutral.colwise().minCoeff()).norm();
  if (!(fapu.eye_separation > 1e-6 * extent) || extent <= 0)
    throw std::invalid_argument("the eyes are in one place (points 3.7, 3.11, 3.8, 3.12): nothing can be measured");

  for (const HumanProportion& human : kHumanProportions) {
    const double usual = human.of_eye_separation * fapu.eye_separation;
    double& unit = unitOf(fapu, human.unit);
    if (unit >= kNearZero * usual) continue;
    measured.substitutions.push_back(std::string(human.name) + " is " + number(unit) + ", too small to measure by; " +
                                     number(usual) + " is used, the human proportion");
    unit = usual;
  }
  return measured;
}

FeaturePointPositions fapuScale(const Fapu& fapu) {
  FeaturePointPositions scale;
  for (std::size_t i = 0; i < kFeaturePointCount; ++i)
    for (int axis = 0; axis < 3; ++axis)
      scale(static_cast<Eigen::Index>(i), axis) = fapu[featurePoints()[i].fapu[static_cast<std::size_t>(axis)]];
  return scale;
}

}  // namespace volto::rig
