#include "rig/rig_file_refined.h"

#include <cmath>
#include <limits>

#include "rig/control_mask.h"

namespace volto::rig {
namespace {

flatbuffers::Offset<file::SparseRows> encodeRows(flatbuffers::FlatBufferBuilder& builder, const SparseRows& rows) {
  std::vector<std::uint32_t> start(rows.start.begin(), rows.start.end());
  const auto starts = builder.CreateVector(start);
  const auto points = builder.CreateVector(rows.point);
  const auto weights = builder.CreateVector(rows.weight);
  return file::CreateSparseRows(builder, starts, points, weights);
}

class Decoder {
 public:
  Decoder(const file::RefinedMask& in, std::size_t vertices, const std::function<void(const std::string&)>& fail)
      : in_(in), vertices_(vertices), fail_(fail) {}

  RefinedMask decode() {
    RefinedMask out;
    const auto* positions = in_.positions();
    const auto* vertex = in_.vertex();
    require(positions != nullptr && vertex != nullptr, "a refined mask without points");
    const std::size_t points = vertex->size();
    require(points >= kFeaturePointCount && points <= kMaxRefinedPoints && positions->size() == 3 * points,
            "a refined mask's points do not add up");
    out.positions = Eigen::Map<const VertexPositions>(positions->data(), static_cast<Eigen::Index>(points), 3);
    require(out.positions.allFinite(), "a point of the refined mask is not finite");
    out.vertex.assign(vertex->data(), vertex->data() + points);
    for (std::size_t p = 0; p < points; ++p)
      require(out.vertex[p] < static_cast<std::int64_t>(vertices_) && out.vertex[p] >= (p < kFeaturePointCount ? -1 : 0),
              "a point of the refined mask is out of range");
    const auto* triangles = in_.triangles();
    const auto* base = in_.base_triangle();
    require(triangles != nullptr && base != nullptr && triangles->size() == 3 * std::size_t{base->size()},
            "a refined mask's triangles do not add up");
    out.base_triangle.assign(base->data(), base->data() + base->size());
    for (std::uint32_t t = 0; t < base->size(); ++t) {
      out.triangles.push_back({triangles->Get(3 * t), triangles->Get(3 * t + 1), triangles->Get(3 * t + 2)});
      for (const std::uint16_t p : out.triangles.back()) require(p < points, "a refined triangle names a point that is not there");
      require(out.base_triangle[t] < kMaskTriangleCount, "a refined triangle is part of none");
    }
    out.to_vertices = rows(in_.to_vertices(), vertices_, points);
    out.from_feature_points = rows(in_.from_feature_points(), points, kFeaturePointCount);
    return out;
  }

 private:
  void require(bool good, const char* what) const {
    if (!good) fail_(what);
  }

  SparseRows rows(const file::SparseRows* in, std::size_t count, std::size_t points) const {
    require(in != nullptr && in->start() != nullptr && in->point() != nullptr && in->weight() != nullptr,
            "the refined mask's rows are missing");
    const auto& start = *in->start();
    require(start.size() == count + 1 && start.Get(0) == 0 && start.Get(static_cast<std::uint32_t>(count)) == in->point()->size() &&
                in->point()->size() == in->weight()->size(),
            "the refined mask's rows do not add up");
    SparseRows out;
    out.start.assign(start.begin(), start.end());
    out.point.assign(in->point()->data(), in->point()->data() + in->point()->size());
    out.weight.assign(in->weight()->data(), in->weight()->data() + in->weight()->size());
    for (std::size_t r = 0; r < count; ++r) {
      require(out.start[r] <= out.start[r + 1] && out.start[r + 1] <= out.point.size(), "the refined mask's rows do not add up");
      for (std::size_t e = out.start[r]; e < out.start[r + 1]; ++e)
        require(out.point[e] < points && (e == out.start[r] || out.point[e - 1] < out.point[e]) && std::isfinite(out.weight[e]),
                "a row of the refined mask is out of order, out of range or not finite");
    }
    return out;
  }

  const file::RefinedMask& in_;
  std::size_t vertices_;
  const std::function<void(const std::string&)>& fail_;
};

}  // namespace

flatbuffers::Offset<file::RefinedMask> encodeRefinedMask(flatbuffers::FlatBufferBuilder& builder,
                                                         const RefinedMask& mask) {
  const auto positions = builder.CreateVector(mask.positions.data(), static_cast<std::size_t>(mask.positions.size()));
  const auto vertex = builder.CreateVector(mask.vertex);
  const auto triangles = builder.CreateVector(mask.triangles.front().data(), 3 * mask.triangles.size());
  const auto base = builder.CreateVector(mask.base_triangle);
  const auto to_vertices = encodeRows(builder, mask.to_vertices);
  const auto from_feature_points = encodeRows(builder, mask.from_feature_points);
  return file::CreateRefinedMask(builder, positions, vertex, triangles, base, to_vertices, from_feature_points);
}

RefinedMask decodeRefinedMask(const file::RefinedMask& in, std::size_t vertices,
                              const std::function<void(const std::string&)>& fail) {
  return Decoder(in, vertices, fail).decode();
}

}  // namespace volto::rig
