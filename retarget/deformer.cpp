#include "retarget/deformer.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <stdexcept>
#include <string>

#include "retarget/deform_kernel.h"

namespace volto::retarget {
namespace {

// Weights of a row are dropped, smallest first, as long as their sum stays below this: 1e-5 of the largest
// displacement.
constexpr float kNegligibleSum = 1e-5F;
constexpr float kFixedPointMax = 32767.0F;
// How many of the neighbouring leftover rows are looked at for a partner; bounds the packing time of very large meshes.
constexpr std::size_t kPartnerWindow = 512;

// Set of control points as 84 bits.
struct Support {
  std::uint64_t low = 0, high = 0;
  void add(std::size_t point) { (point < 64 ? low : high) |= std::uint64_t{1} << (point % 64); }
  bool has(std::size_t point) const { return ((point < 64 ? low : high) >> (point % 64) & 1U) != 0; }
  int size() const { return std::popcount(low) + std::popcount(high); }
  bool empty() const { return (low | high) == 0; }
  Support operator|(const Support& other) const { return {low | other.low, high | other.high}; }
  auto operator<=>(const Support&) const = default;
};

struct Row {
  Support support;
  std::uint32_t vertex;
  bool operator<(const Row& other) const {
    return support != other.support ? support < other.support : vertex < other.vertex;
  }
};

void checkOperator(const rig::DeformationOperator& op, std::size_t vertex_count) {
  if (op.vertexCount() != vertex_count) {
    throw std::invalid_argument("deformation operator has " + std::to_string(op.vertexCount()) +
                                " rows for a mesh of " + std::to_string(vertex_count) + " vertices");
  }
  if (vertex_count == 0) return;
  const bool ordered = std::is_sorted(op.row_start.begin(), op.row_start.end());
  if (!ordered || op.row_start.front() != 0 || op.row_start.back() != op.point.size() ||
      op.point.size() != op.weight.size()) {
    throw std::invalid_argument("deformation operator is inconsistent: row starts do not fit its entries");
  }
  for (std::size_t i = 0; i < op.point.size(); ++i) {
    if (op.point[i] >= kFeaturePointCount || !std::isfinite(op.weight[i])) {
      throw std::invalid_argument("deformation operator entry " + std::to_string(i) + " names control point " +
                                  std::to_string(op.point[i]) + " with weight " + std::to_string(op.weight[i]));
    }
  }
}

// The row without the weights that cannot be seen. Scratch is reused between rows.
Support significantSupport(const rig::DeformationOperator& op, std::size_t vertex,
                           std::vector<std::uint32_t>& scratch) {
  scratch.clear();
  for (std::uint32_t i = op.row_start[vertex]; i < op.row_start[vertex + 1]; ++i) scratch.push_back(i);
  std::sort(scratch.begin(), scratch.end(), [&](std::uint32_t a, std::uint32_t b) {
    const float wa = std::abs(op.weight[a]), wb = std::abs(op.weight[b]);
    return wa != wb ? wa < wb : a < b;
  });
  float dropped = 0.0F;
  Support support;
  for (const std::uint32_t i : scratch) {
    dropped += std::abs(op.weight[i]);
    if (dropped >= kNegligibleSum) support.add(op.point[i]);
  }
  return support;
}

// Rows that fill no block of their own kind are joined with those whose control points differ least.
std::vector<std::vector<Row>> joinLeftovers(std::vector<std::vector<Row>> leftovers) {
  std::vector<std::vector<Row>> blocks;
  // Largest support first; equal sizes stay in order of support, so that neighbours in the list are alike.
  std::stable_sort(leftovers.begin(), leftovers.end(),
                   [](const auto& a, const auto& b) { return a.front().support.size() > b.front().support.size(); });
  std::size_t remaining = leftovers.size();
  std::size_t first = 0;
  while (remaining > 0) {
    while (leftovers[first].empty()) ++first;
    std::vector<Row> block = std::move(leftovers[first]);
    leftovers[first].clear();
    --remaining;
    Support support = block.front().support;
    while (block.size() < kBlockLanes && remaining > 0) {
      std::size_t best = 0;
      int best_cost = 1000;
      for (std::size_t i = first + 1, seen = 0; i < leftovers.size() && seen < kPartnerWindow; ++i) {
        if (leftovers[i].empty()) continue;
        ++seen;
        const Support other = leftovers[i].front().support;
        const Support both = support | other;
        const int cost = 2 * both.size() - support.size() - other.size();  // zeros that either side would carry
        if (cost < best_cost) {
          best_cost = cost;
          best = i;
        }
      }
      if (best_cost == 1000) break;
      std::vector<Row>& partner = leftovers[best];
      const std::size_t take = std::min(partner.size(), kBlockLanes - block.size());
      support = support | partner.front().support;
      block.insert(block.end(), partner.begin(), partner.begin() + static_cast<std::ptrdiff_t>(take));
      partner.erase(partner.begin(), partner.begin() + static_cast<std::ptrdiff_t>(take));
      if (partner.empty()) --remaining;
    }
    blocks.push_back(std::move(block));
  }
  return blocks;
}

// Groups of at most 16 vertices each, so that each group's union of control points is small.
std::vector<std::vector<Row>> chooseBlocks(std::vector<Row> rows) {
  std::sort(rows.begin(), rows.end());
  std::vector<std::vector<Row>> blocks, leftovers;
  for (std::size_t begin = 0; begin < rows.size();) {
    std::size_t end = begin;
    while (end < rows.size() && rows[end].support == rows[begin].support) ++end;
    for (; begin + kBlockLanes <= end; begin += kBlockLanes) {
      blocks.emplace_back(rows.begin() + static_cast<std::ptrdiff_t>(begin),
                          rows.begin() + static_cast<std::ptrdiff_t>(begin + kBlockLanes));
    }
    if (begin < end) {
      leftovers.emplace_back(rows.begin() + static_cast<std::ptrdiff_t>(begin),
                             rows.begin() + static_cast<std::ptrdiff_t>(end));
    }
    begin = end;
  }
  for (std::vector<Row>& block : joinLeftovers(std::move(leftovers))) {
    std::sort(block.begin(), block.end(), [](const Row& a, const Row& b) { return a.vertex < b.vertex; });
    blocks.push_back(std::move(block));
  }
  // Blocks in the order of the mesh, so that the result is written roughly from front to back.
  std::sort(blocks.begin(), blocks.end(),
            [](const auto& a, const auto& b) { return a.front().vertex < b.front().vertex; });
  return blocks;
}

// Rounds one row to the block's fixed point. What rounding one weight loses is handed to the next, so that the sum of
// the row, which carries the motion that all points share, stays right to half a step.
void quantizeRow(const rig::DeformationOperator& op, const Row& row, float unit, std::span<const std::uint8_t> points,
                 std::size_t lane, std::int16_t* weights) {
  double carried = 0.0;
  for (std::uint32_t i = op.row_start[row.vertex]; i < op.row_start[row.vertex + 1]; ++i) {
    const double exact = static_cast<double>(op.weight[i]) / static_cast<double>(unit) + carried;
    if (!row.support.has(op.point[i])) {
      carried = exact;
      continue;
    }
    const double rounded = std::clamp(std::round(exact), -32768.0, 32767.0);
    carried = exact - rounded;
    const auto slot =
        static_cast<std::size_t>(std::lower_bound(points.begin(), points.end(), op.point[i]) - points.begin());
    weights[slot * kBlockLanes + lane] = static_cast<std::int16_t>(rounded);
  }
}

void appendBlock(const rig::DeformationOperator& op, std::span<const Vertex> neutral, const std::vector<Row>& rows,
                 PackedOperator& packed) {
  Support support;
  float largest = 0.0F;
  for (const Row& row : rows) {
    support = support | row.support;
    for (std::uint32_t i = op.row_start[row.vertex]; i < op.row_start[row.vertex + 1]; ++i) {
      largest = std::max(largest, std::abs(op.weight[i]));
    }
  }
  DeformBlock block{};
  block.first_point = static_cast<std::uint32_t>(packed.points.size());
  block.point_count = static_cast<std::uint16_t>(support.size());
  block.lane_count = static_cast<std::uint8_t>(rows.size());
  block.weight_unit = largest / kFixedPointMax;
  block.in_order = rows.size() == kBlockLanes && rows.back().vertex - rows.front().vertex == kBlockLanes - 1;
  for (std::size_t point = 0; point < kFeaturePointCount; ++point) {
    if (support.has(point)) packed.points.push_back(static_cast<std::uint8_t>(point));
  }
  packed.weights.resize(packed.points.size() * kBlockLanes, 0);
  const std::span<const std::uint8_t> points(packed.points.data() + block.first_point, block.point_count);
  std::int16_t* weights = packed.weights.data() + std::size_t{block.first_point} * kBlockLanes;
  const std::size_t first_neutral = packed.neutral.size();
  packed.neutral.resize(first_neutral + 3 * kBlockLanes, 0.0F);
  for (std::size_t lane = 0; lane < kBlockLanes; ++lane) {
    const Row& row = rows[std::min(lane, rows.size() - 1)];
    packed.vertex.push_back(row.vertex);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      packed.neutral[first_neutral + axis * kBlockLanes + lane] = neutral[row.vertex][axis];
    }
    if (lane < rows.size()) quantizeRow(op, row, block.weight_unit, points, lane, weights);
  }
  packed.blocks.push_back(block);
}

}  // namespace

Deformer::Deformer(const rig::DeformationOperator& deformation, std::span<const Vertex> neutral)
    : neutral_(neutral.begin(), neutral.end()), entry_count_(deformation.point.size()) {
  checkOperator(deformation, neutral.size());
  for (const Vertex& position : neutral) {
    if (!std::isfinite(position[0]) || !std::isfinite(position[1]) || !std::isfinite(position[2])) {
      throw std::invalid_argument("neutral vertex " + std::to_string(&position - neutral.data()) + " is not finite");
    }
  }
  std::vector<Row> rows;
  std::vector<std::uint32_t> scratch;
  for (std::uint32_t vertex = 0; vertex < neutral.size(); ++vertex) {
    const Support support = significantSupport(deformation, vertex, scratch);
    if (!support.empty()) {
      rows.push_back({support, vertex});
    } else if (!packed_.unmoved.empty() && packed_.unmoved.back().first + packed_.unmoved.back().count == vertex) {
      ++packed_.unmoved.back().count;
    } else {
      packed_.unmoved.push_back({vertex, 1});
    }
  }
  for (const std::vector<Row>& block : chooseBlocks(std::move(rows))) appendBlock(deformation, neutral, block, packed_);
}

void Deformer::deform(const MeshMaskDisplacement& displacement, std::span<Vertex> out) const {
  if (out.size() != neutral_.size()) {
    throw std::invalid_argument("room for " + std::to_string(out.size()) + " vertices, the mesh has " +
                                std::to_string(neutral_.size()));
  }
  const bool at_rest = std::all_of(displacement.begin(), displacement.end(), [](const auto& move) {
    return move[0] == 0.0F && move[1] == 0.0F && move[2] == 0.0F;
  });
  if (at_rest) {
    std::copy(neutral_.begin(), neutral_.end(), out.begin());
    return;
  }
  for (const PackedOperator::Run run : packed_.unmoved) {
    std::copy_n(neutral_.begin() + run.first, run.count, out.begin() + run.first);
  }
  deformBlocks(packed_, displacement, out.data());
}

}  // namespace volto::retarget
