// Meshes as the bytes of a file, made by hand for the reader tests.
#pragma once

#include <bit>
#include <cstdint>
#include <cstring>
#include <string>

#include "rig/mesh_io.h"

namespace volto::test {

// Bytes of a number, either way round.
template <typename T>
std::string bytesOf(T value, bool big_endian = false) {
  std::string bytes(sizeof value, '\0');
  std::memcpy(bytes.data(), &value, sizeof value);
  return big_endian ? std::string(bytes.rbegin(), bytes.rend()) : bytes;
}

template <typename Reader>
std::string complaintOf(const Reader& read) {
  try {
    read();
  } catch (const rig::InputError& error) {
    return error.what();
  }
  return {};
}

// A tetrahedron with an odd vertex order: five vertices, one of them unused, four triangles.
inline rig::Mesh tetrahedron() {
  return rig::parseObj("v 0 0 0\nv 1 0 0.25\nv 9 9 9\nv 0 1 -0.5\nv 0.125 0.25 1\nf 4 2 1\nf 1 2 5\nf 2 4 5\nf 4 1 5\n",
                  "tetrahedron");
}

// GLB container around JSON and a binary chunk.
inline std::string glb(std::string json, std::string binary) {
  while (json.size() % 4 != 0) json += ' ';
  while (binary.size() % 4 != 0) binary += '\0';
  std::string out = "glTF" + bytesOf<std::uint32_t>(2);
  out += bytesOf(static_cast<std::uint32_t>(12 + 8 + json.size() + (binary.empty() ? 0 : 8 + binary.size())));
  out += bytesOf(static_cast<std::uint32_t>(json.size())) + "JSON" + json;
  if (!binary.empty()) out += bytesOf(static_cast<std::uint32_t>(binary.size())) + std::string("BIN\0", 4) + binary;
  return out;
}

}  // namespace volto::test
