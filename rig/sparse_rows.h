// Rows of weights over the points of a control mask, most of them zero.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace volto::rig {

// Compressed: row r has the entries start[r] .. start[r + 1] - 1, its points ascending.
struct SparseRows {
  std::vector<std::size_t> start{0};
  std::vector<std::uint16_t> point;
  std::vector<float> weight;

  std::size_t size() const { return start.size() - 1; }
  std::span<const std::uint16_t> points(std::size_t r) const { return {point.data() + start[r], start[r + 1] - start[r]}; }
  std::span<const float> weights(std::size_t r) const { return {weight.data() + start[r], start[r + 1] - start[r]}; }
};

// A row while it is being made: weights may be added in any order.
class RowBuilder {
 public:
  explicit RowBuilder(std::size_t points) : weight_(points, 0.0), used_(points, false) {}

  void add(std::size_t point, double weight) {
    if (!used_[point]) {
      used_[point] = true;
      touched_.push_back(static_cast<std::uint16_t>(point));
    }
    weight_[point] += weight;
  }
  void addRow(const SparseRows& rows, std::size_t r, double scale) {
    for (std::size_t i = rows.start[r]; i < rows.start[r + 1]; ++i) add(rows.point[i], scale * rows.weight[i]);
  }
  void scale(double factor) {
    for (const std::uint16_t p : touched_) weight_[p] *= factor;
  }
  // Weights near zero go, smoothly (below 1e-3 entirely, above 4e-3 not at all), and what remains keeps the row's sum.
  void dropSmall();
  double sum() const {
    double total = 0;
    for (const std::uint16_t p : touched_) total += weight_[p];
    return total;
  }
  bool moves() const {
    for (const std::uint16_t p : touched_)
      if (weight_[p] != 0) return true;
    return false;
  }
  void clear();
  // Appends the row to `rows` and starts a new, empty one.
  void finish(SparseRows& rows);

 private:
  std::vector<double> weight_;
  std::vector<bool> used_;
  std::vector<std::uint16_t> touched_;
};

}  // namespace volto::rig
