// The straightforward ways that Volto is measured against, written well and compiled with the flags of the library (or
// for this very machine: VOLTO_BENCH_NATIVE), in a shared library of their own so that nothing of it leaks into Volto's
// code. Plain pointers in and out; floats unless said.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#if defined(__GNUC__)
#define VOLTO_BENCH_EXPORT __attribute__((visibility("default")))
#else
#define VOLTO_BENCH_EXPORT
#endif

namespace volto::bench {

using Float3 = std::array<float, 3>;

// vertex = neutral + operator x displacement by a plain loop over compressed rows.
VOLTO_BENCH_EXPORT void csrDeform(std::span<const std::uint32_t> row_start, std::span<const std::uint8_t> point,
                                  std::span<const float> weight, std::span<const Float3> neutral,
                                  std::span<const Float3> displacement, std::span<Float3> out);

// The same with Eigen's row-major sparse matrix.
class VOLTO_BENCH_EXPORT EigenDeform {
 public:
  EigenDeform(std::span<const std::uint32_t> row_start, std::span<const std::uint8_t> point,
              std::span<const float> weight, std::span<const Float3> neutral);
  ~EigenDeform();
  void deform(std::span<const Float3> displacement, std::span<Float3> out) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

// Queiroz, equations 3 to 5, as printed: every frame builds and solves one multiquadric system for each of the 136
// triangles and evaluates it at the vertices that are associated with the triangle. No blending between regions.
class VOLTO_BENCH_EXPORT PerFrameRbf {
 public:
  // controls: 84 neutral positions. region[t]: control points of triangle t. triangle[v]: of each vertex, -1 for none.
  PerFrameRbf(std::span<const Float3> controls, const std::vector<std::vector<std::uint8_t>>& region,
              std::span<const std::int16_t> triangle, std::span<const Float3> neutral);
  ~PerFrameRbf();
  void deform(std::span<const Float3> displacement, std::span<Float3> out) const;
  std::size_t movedVertexCount() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

// min |A w - b| over stacked rows (the ridge is part of A and b). A: `rows` by `columns`, column-major.
class VOLTO_BENCH_EXPORT LeastSquares {
 public:
  LeastSquares(std::span<const double> a, std::size_t rows, std::size_t columns);
  ~LeastSquares();
  // Householder QR of A in every call, then clamped to 0..1.
  void byQr(std::span<const double> b, std::span<double> w) const;
  // Lawson and Hanson's general non-negative least squares, from nothing in every call.
  void byNnls(std::span<const double> b, std::span<double> w) const;
  // 0 <= w <= 1 to 1e-10, slowly: accelerated projected gradient. The truth for errors.
  void exact(std::span<const double> b, std::span<double> w) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace volto::bench
