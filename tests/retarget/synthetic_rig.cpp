#include "tests/retarget/synthetic_rig.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "frames/arkit_blendshapes.h"

namespace volto::test {
namespace {

using Point = std::array<double, 3>;

// splitmix64: the same numbers everywhere.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed * 0x9E3779B97F4A7C15ULL + 1) {}
  double unit() {
    std::uint64_t z = (state_ += 0x9E3779B97F4A7C15ULL);
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ULL;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBULL;
    return static_cast<double>((z ^ (z >> 31)) >> 11) * 0x1.0p-53;
  }
  double between(double low, double high) { return low + (high - low) * unit(); }

 private:
  std::uint64_t state_;
};

double halton(int index, int base) {
  double result = 0.0, fraction = 1.0;
  for (; index > 0; index /= base) {
    fraction /= base;
    result += fraction * (index % base);
  }
  return result;
}

double distance(const Point& a, const Point& b) { return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]); }

Point onSheet(double x, double y, double size) { return {x * size, y * size, (0.5 - 0.3 * (x * x + y * y)) * size}; }

// Control points by distance from `from`.
std::vector<std::size_t> nearest(const std::vector<Point>& controls, const Point& from) {
  std::vector<std::size_t> order(controls.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    const double da = distance(controls[a], from), db = distance(controls[b], from);
    return da != db ? da < db : a < b;
  });
  return order;
}

void addRow(const std::vector<Point>& controls, const Point& vertex, double fade, const SyntheticRigOptions& options,
            rig::DeformationOperator& op) {
  std::array<double, kFeaturePointCount> weight{};
  if (fade > 0.0) {
    // The neighbourhood of the nearest control point, and near a border that of the second nearest as well.
    const auto order = nearest(controls, vertex);
    const double d0 = distance(controls[order[0]], vertex), d1 = distance(controls[order[1]], vertex);
    const int cells = d1 < 1.2 * d0 ? 2 : 1;
    double sum = 0.0;
    for (int cell = 0; cell < cells; ++cell) {
      const auto members = nearest(controls, controls[order[static_cast<std::size_t>(cell)]]);
      for (std::size_t i = 0; i <= options.neighbours; ++i) {
        const double d = distance(controls[members[i]], vertex) / options.size;
        // Some weights are negative, as those of an interpolation are.
        const double w = std::exp(-20.0 * d * d) - 0.02 * std::sin(9.0 * d);
        weight[members[i]] += w;
        sum += w;
      }
    }
    for (double& w : weight) w *= fade / sum;
  }
  for (std::size_t p = 0; p < kFeaturePointCount; ++p) {
    if (weight[p] == 0.0) continue;
    op.point.push_back(static_cast<std::uint8_t>(p));
    op.weight.push_back(static_cast<float>(weight[p]));
  }
  op.row_start.push_back(static_cast<std::uint32_t>(op.point.size()));
}

rig::RigidPart eyeball(bool left, const SyntheticRigOptions& options, std::vector<Point>& vertices) {
  rig::RigidPart part;
  part.name = left ? "left eyeball" : "right eyeball";
  part.follows = left ? rig::RigidPart::Follows::left_eye : rig::RigidPart::Follows::right_eye;
  part.centre = {(left ? 0.3 : -0.3) * options.size, 0.3 * options.size, 0.3 * options.size};
  for (int i = 0; i < 60; ++i) {
    const double z = 1.0 - 2.0 * (i + 0.5) / 60.0, r = std::sqrt(1.0 - z * z), turn = 2.399963 * i,
                 radius = 0.12 * options.size;
    part.vertices.push_back(static_cast<std::uint32_t>(vertices.size()));
    vertices.push_back({part.centre[0] + radius * r * std::cos(turn), part.centre[1] + radius * r * std::sin(turn),
                        part.centre[2] + radius * z});
  }
  return part;
}

}  // namespace

rig::Rig syntheticRig(const SyntheticRigOptions& options) {
  rig::Rig out;
  out.name = "sheet";
  Random random(options.seed);
  std::vector<Point> controls;
  for (std::size_t p = 0; p < kFeaturePointCount; ++p) {
    const int i = static_cast<int>(p) + 11;
    controls.push_back(onSheet(1.6 * halton(i, 2) - 0.8, 1.6 * halton(i, 3) - 0.8, options.size));
    for (std::size_t axis = 0; axis < 3; ++axis) {
      out.feature_positions(static_cast<Eigen::Index>(p), static_cast<Eigen::Index>(axis)) = controls[p][axis];
    }
  }
  out.feature_vertex.fill(-1);

  std::vector<Point> vertices;
  out.deformation.row_start.push_back(0);
  const std::size_t side = options.skin_side;
  for (std::size_t row = 0; row < side; ++row) {
    for (std::size_t column = 0; column < side; ++column) {
      const double x = 2.0 * static_cast<double>(column) / static_cast<double>(side - 1) - 1.0;
      const double y = 2.0 * static_cast<double>(row) / static_cast<double>(side - 1) - 1.0;
      vertices.push_back(onSheet(x, y, options.size));
      const double edge = std::max(std::abs(x), std::abs(y));
      addRow(controls, vertices.back(), std::clamp((0.9 - edge) / 0.1, 0.0, 1.0), options, out.deformation);
    }
  }
  for (const bool left : {true, false}) out.rigid_parts.push_back(eyeball(left, options, vertices));
  out.deformation.row_start.resize(vertices.size() + 1, out.deformation.row_start.back());

  out.neutral.positions.resize(static_cast<Eigen::Index>(vertices.size()), 3);
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      out.neutral.positions(static_cast<Eigen::Index>(v), static_cast<Eigen::Index>(axis)) = vertices[v][axis];
    }
  }
  out.fapu.fapu = {0.1 * options.size, 0.6 * options.size, 0.45 * options.size, 0.2 * options.size, 0.5 * options.size};

  for (std::size_t k = 0; k < options.blendshapes; ++k) {
    rig::Blendshape shape;
    shape.name = k < kArkitBlendshapeCount ? std::string(kArkitBlendshapeNames[k]) : "custom" + std::to_string(k);
    const Point centre = onSheet(random.between(-0.7, 0.7), random.between(-0.7, 0.7), options.size);
    const Point direction{random.between(-1, 1), random.between(-1, 1), random.between(-1, 1)};
    const double reach = random.between(0.1, 0.35) * options.size;
    for (std::size_t p = 0; p < kFeaturePointCount; ++p) {
      const double d = distance(controls[p], centre) / reach;
      if (d > 2.0) continue;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        shape.mask_displacement[p][axis] = static_cast<float>(0.12 * options.size * std::exp(-d * d) * direction[axis]);
      }
    }
    if (shape.name == "tongueOut") {
      shape.mask_displacement = {};
      shape.moves_mask = false;
    }
    out.blendshapes.push_back(std::move(shape));
  }
  return out;
}

MaskDisplacements syntheticExpression(std::uint32_t seed, float amplitude) {
  Random random(seed + 1000);
  const double a = random.between(1, 4), b = random.between(1, 4), phase = random.between(0, 6);
  MaskDisplacements out{};
  for (std::size_t p = 0; p < kFeaturePointCount; ++p) {
    const int i = static_cast<int>(p) + 11;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double wave =
          std::sin(a * halton(i, 2) + phase + static_cast<double>(axis)) * std::cos(b * halton(i, 3) - phase);
      out[p][axis] = amplitude * static_cast<float>(wave + 0.1 * random.between(-1, 1));
    }
  }
  return out;
}

rig::VertexPositions deformReference(const rig::Rig& rig, const MaskDisplacements& displacement_fapu) {
  const auto unit = [&rig](rig::FapuUnit which) {
    switch (which) {
      case rig::FapuUnit::iris_diameter:
        return rig.fapu.fapu.iris_diameter;
      case rig::FapuUnit::eye_separation:
        return rig.fapu.fapu.eye_separation;
      case rig::FapuUnit::eye_nose:
        return rig.fapu.fapu.eye_nose;
      case rig::FapuUnit::mouth_nose:
        return rig.fapu.fapu.mouth_nose;
      case rig::FapuUnit::mouth_width:
        return rig.fapu.fapu.mouth_width;
    }
    return 0.0;
  };
  rig::FeaturePointPositions moved;
  for (std::size_t p = 0; p < kFeaturePointCount; ++p) {
    Eigen::Vector3d head;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      head[static_cast<Eigen::Index>(axis)] =
          static_cast<double>(displacement_fapu[p][axis]) * unit(rig::featurePoints()[p].fapu[axis]);
    }
    moved.row(static_cast<Eigen::Index>(p)) = (rig.mesh_from_head * head).transpose();
  }
  rig::VertexPositions out = rig.neutral.positions;
  for (std::size_t v = 0; v < rig.deformation.vertexCount(); ++v) {
    for (std::uint32_t i = rig.deformation.row_start[v]; i < rig.deformation.row_start[v + 1]; ++i) {
      out.row(static_cast<Eigen::Index>(v)) +=
          static_cast<double>(rig.deformation.weight[i]) * moved.row(rig.deformation.point[i]);
    }
  }
  return out;
}

}  // namespace volto::test
