// The equations that make displacements of a skin fair: one sparse factorisation, then as many right sides as wanted.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "rig/geodesic.h"
#include "rig/skin.h"

namespace volto::rig {

// A control point on the skin: one vertex, or the three of the triangle it lies in.
struct SkinPoint {
  std::vector<GeodesicSource> around;  // the vertices and how far they are
  std::vector<double> weight;          // barycentric, sum 1
  bool isVertex() const { return around.size() == 1; }
};

// A vertex that is one piece with another place of the skin (rig/lining.h).
struct SkinTie {
  std::uint32_t vertex = 0;
  std::array<std::uint32_t, 3> to{};
  std::array<double, 3> weight{};  // barycentric
  double share = 0;                // ]0, 1]: how much of one piece they are
};

// One row per unknown, or per control point; one column per right side.
using Columns = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// x minimises  sum over vertices of |Laplacian x|^2 area + sum of area data_weight |x - data|^2 + tension |grad x|^2 area
// where there is no data + tie share |x - x at the other place|^2 area over the ties (lengths in eye separations), with x held at the control points to their values and free at
// the border to vertices that are no unknowns: constants stay constants. Area and Laplacian make the solution one of the surface, not of how densely it is
// meshed; tension keeps it from overshooting where nothing holds it (mouth, nostrils, neck).
class SkinEquations {
 public:
  // `unknown`: #V, index of each vertex that is an unknown, -1 for others. `data_weight`: per unknown. Factors once.
  // Throws std::runtime_error when the skin's equations cannot be solved.
  SkinEquations(const Skin& skin, std::span<const std::int32_t> unknown, std::span<const double> data_weight,
                std::span<const SkinPoint> points, std::span<const SkinTie> ties, double eye_separation);
  ~SkinEquations();
  SkinEquations(SkinEquations&&) noexcept;
  SkinEquations& operator=(SkinEquations&&) noexcept;

  // `data`: #unknowns by C, replaced by the solution. `values`: #points by C. Thread-safe.
  void solve(const Columns& values, Columns& data) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace volto::rig
