// Bytes changed in a rig file, with a checksum that fits again, so that what lies behind the checksum is tried: refused
// with one line, or a rig that can be written and read once more. Input: five bytes a change, offset (little-endian)
// and new value.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <string_view>
#include <vector>

#include "rig/build_rig.h"
#include "rig/rig_file.h"

using namespace volto;
using namespace volto::rig;

namespace {

constexpr std::size_t kChecksumAt = 12;  // rig/README.md: the header

void require(bool holds) {
  if (!holds) std::abort();
}

// CRC-32C bit by bit, written apart from the library's.
std::uint32_t crc32c(const std::vector<std::byte>& bytes) {
  std::uint32_t crc = 0xFFFFFFFFU;
  for (const std::byte byte : bytes) {
    crc ^= static_cast<std::uint32_t>(byte);
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1) ^ ((crc & 1U) != 0 ? 0x82F63B78U : 0U);
  }
  return ~crc;
}

// The smallest head there is: the control mask itself.
std::vector<std::byte> smallRig() {
  Mesh mesh;
  mesh.positions = referenceMask();
  mesh.polygon_start.push_back(0);
  for (const MaskTriangle& triangle : maskTriangles()) {
    mesh.corner_vertices.insert(mesh.corner_vertices.end(), triangle.begin(), triangle.end());
    mesh.polygon_start.push_back(static_cast<std::uint32_t>(mesh.corner_vertices.size()));
  }
  FeaturePointChoices points;
  for (std::size_t i = 0; i < kFeaturePointCount; ++i) points[i] = static_cast<std::uint32_t>(i);
  RigOptions options;
  options.name = "mask";
  options.mesh_file = "mask.obj";
  Rig rig = buildRig(mesh, points, options);
  rig.blendshapes.resize(2);  // small, so that a change hits something
  return encodeRig(rig);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::vector<std::byte> whole = smallRig();
  std::vector<std::byte> bytes = whole;
  for (; size >= 5; data += 5, size -= 5) {
    std::uint32_t offset = 0;
    std::memcpy(&offset, data, 4);
    bytes[offset % bytes.size()] = static_cast<std::byte>(data[4]);
  }
  std::memset(bytes.data() + kChecksumAt, 0, 4);
  const std::uint32_t crc = crc32c(bytes);
  std::memcpy(bytes.data() + kChecksumAt, &crc, 4);
  try {
    const Rig rig = decodeRig(bytes, "c.rig");
    require(rig.neutral.positions.allFinite() && rig.deformation.vertexCount() == rig.neutral.vertexCount());
    for (const std::uint8_t point : rig.deformation.point) require(point < kFeaturePointCount);
    const std::vector<std::byte> again = encodeRig(rig);
    require(encodeRig(decodeRig(again, "again.rig")) == again);
  } catch (const InputError& error) {
    const std::string_view text = error.what();
    require(text.starts_with("c.rig") && text.find('\n') == std::string_view::npos && text.size() < 600);
  }
  return 0;
}
