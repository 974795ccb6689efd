#include "tools/export/glb_buffer.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <stdexcept>

namespace volto::exporter {
namespace {

static_assert(std::endian::native == std::endian::little);

void bound(tinygltf::Accessor& accessor, std::span<const Float3> values) {
  accessor.minValues.assign(3, 0.0);
  accessor.maxValues.assign(3, 0.0);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (values.empty()) continue;
    float low = values[0][axis], high = values[0][axis];
    for (const Float3& v : values) low = std::min(low, v[axis]), high = std::max(high, v[axis]);
    accessor.minValues[axis] = static_cast<double>(low);
    accessor.maxValues[axis] = static_cast<double>(high);
  }
}

}  // namespace

GlbBuffer::GlbBuffer(tinygltf::Model& model) : model_(model) {
  if (model_.buffers.empty()) model_.buffers.emplace_back();
}

int GlbBuffer::view(const void* bytes, std::size_t size, int target) {
  std::vector<unsigned char>& data = model_.buffers[0].data;
  // A GLB file counts its bytes in 32 bits, and many programs in 31.
  if (data.size() + size > 0x7F000000U)
    throw std::length_error(
        "more than 2 GB of data for one GLB file; export a shorter stretch (--from, --to, --every)");
  tinygltf::BufferView out;
  out.buffer = 0;
  out.byteOffset = data.size();
  out.byteLength = size;
  out.target = target;
  const auto* first = static_cast<const unsigned char*>(bytes);
  data.insert(data.end(), first, first + size);
  data.resize((data.size() + 3) & ~std::size_t{3}, 0);
  model_.bufferViews.push_back(std::move(out));
  return static_cast<int>(model_.bufferViews.size()) - 1;
}

int GlbBuffer::accessor(int view, int component_type, int type, std::size_t count) {
  tinygltf::Accessor out;
  out.bufferView = view;
  out.componentType = component_type;
  out.type = type;
  out.count = count;
  model_.accessors.push_back(std::move(out));
  return static_cast<int>(model_.accessors.size()) - 1;
}

int GlbBuffer::floats(std::span<const float> values, bool bounds) {
  const int out = accessor(view(values.data(), values.size_bytes(), 0), TINYGLTF_COMPONENT_TYPE_FLOAT,
                           TINYGLTF_TYPE_SCALAR, values.size());
  if (bounds && !values.empty()) {
    const auto [low, high] = std::minmax_element(values.begin(), values.end());
    model_.accessors.back().minValues = {static_cast<double>(*low)};
    model_.accessors.back().maxValues = {static_cast<double>(*high)};
  }
  return out;
}

int GlbBuffer::vectors2(std::span<const std::array<float, 2>> values) {
  return accessor(view(values.data(), values.size_bytes(), TINYGLTF_TARGET_ARRAY_BUFFER), TINYGLTF_COMPONENT_TYPE_FLOAT,
                  TINYGLTF_TYPE_VEC2, values.size());
}

int GlbBuffer::vectors3(std::span<const Float3> values, bool bounds) {
  const int out = accessor(view(values.data(), values.size_bytes(), TINYGLTF_TARGET_ARRAY_BUFFER),
                           TINYGLTF_COMPONENT_TYPE_FLOAT, TINYGLTF_TYPE_VEC3, values.size());
  if (bounds) bound(model_.accessors.back(), values);
  return out;
}

int GlbBuffer::vectors4(std::span<const std::array<float, 4>> values) {
  return accessor(view(values.data(), values.size_bytes(), 0), TINYGLTF_COMPONENT_TYPE_FLOAT, TINYGLTF_TYPE_VEC4,
                  values.size());
}

int GlbBuffer::colours(std::span<const Float3> values) {
  std::vector<std::array<std::uint16_t, 4>> rgba;
  rgba.reserve(values.size());
  const auto part = [](float x) {
    return static_cast<std::uint16_t>(std::lround(std::clamp(x, 0.0F, 1.0F) * 65535.0F));
  };
  for (const Float3& v : values) rgba.push_back({part(v[0]), part(v[1]), part(v[2]), 65535});
  const int out = accessor(view(rgba.data(), rgba.size() * sizeof rgba[0], TINYGLTF_TARGET_ARRAY_BUFFER),
                           TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT, TINYGLTF_TYPE_VEC4, rgba.size());
  model_.accessors.back().normalized = true;
  return out;
}

int GlbBuffer::joints(std::span<const std::array<std::uint16_t, 4>> values) {
  return accessor(view(values.data(), values.size_bytes(), TINYGLTF_TARGET_ARRAY_BUFFER),
                  TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT, TINYGLTF_TYPE_VEC4, values.size());
}

int GlbBuffer::matrices4(std::span<const std::array<float, 16>> values) {
  return accessor(view(values.data(), values.size_bytes(), 0), TINYGLTF_COMPONENT_TYPE_FLOAT, TINYGLTF_TYPE_MAT4,
                  values.size());
}

int GlbBuffer::indices(std::span<const std::uint32_t> values, std::size_t vertices) {
  // 65535 itself means "begin a new strip" to graphics cards.
  if (vertices > 65535)
    return accessor(view(values.data(), values.size_bytes(), TINYGLTF_TARGET_ELEMENT_ARRAY_BUFFER),
                    TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT, TINYGLTF_TYPE_SCALAR, values.size());
  std::vector<std::uint16_t> small(values.begin(), values.end());
  return accessor(view(small.data(), small.size() * 2, TINYGLTF_TARGET_ELEMENT_ARRAY_BUFFER),
                  TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT, TINYGLTF_TYPE_SCALAR, small.size());
}

int GlbBuffer::sparseVectors3(std::span<const Float3> values, float least, bool bounds) {
  std::vector<std::uint32_t> at;
  std::vector<Float3> changed, all(values.size(), Float3{});
  for (std::size_t i = 0; i < values.size(); ++i) {
    const Float3& v = values[i];
    if (!(std::max({std::abs(v[0]), std::abs(v[1]), std::abs(v[2])}) > least)) continue;
    at.push_back(static_cast<std::uint32_t>(i));
    changed.push_back(v);
    all[i] = v;
  }
  const bool small = values.size() <= 65535;
  const std::size_t sparse_bytes = at.size() * (12 + (small ? 2 : 4));
  if (sparse_bytes >= values.size_bytes()) return vectors3(all, bounds);
  const int out = accessor(-1, TINYGLTF_COMPONENT_TYPE_FLOAT, TINYGLTF_TYPE_VEC3, values.size());
  if (bounds) bound(model_.accessors.back(), all);
  if (at.empty()) {  // a sparse part of nothing is not allowed; one zero says the same
    at.push_back(0);
    changed.push_back({});
  }
  int index_view = 0;
  if (small) {
    std::vector<std::uint16_t> short_at(at.begin(), at.end());
    index_view = view(short_at.data(), short_at.size() * 2, 0);
  } else {
    index_view = view(at.data(), at.size() * 4, 0);
  }
  const int value_view = view(changed.data(), changed.size() * sizeof changed[0], 0);
  auto& sparse = model_.accessors[static_cast<std::size_t>(out)].sparse;
  sparse.isSparse = true;
  sparse.count = static_cast<int>(at.size());
  sparse.indices.bufferView = index_view;
  sparse.indices.byteOffset = 0;
  sparse.indices.componentType = small ? TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT : TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT;
  sparse.values.bufferView = value_view;
  sparse.values.byteOffset = 0;
  return out;
}

}  // namespace volto::exporter
