// STL: triangles without shared vertices, as text or as 50 bytes each. Corners at the same place become one vertex, so
// that the surface is connected again; triangles keep their order.
#include <bit>
#include <cmath>
#include <cstring>
#include <unordered_map>

#include "rig/mesh_builder.h"
#include "rig/mesh_io.h"
#include "rig/mesh_limits.h"
#include "rig/text_scanner.h"

namespace volto::rig {
namespace {

constexpr std::size_t kHeaderBytes = 84, kTriangleBytes = 50;

using Corner = std::array<double, 3>;

struct CornerHash {
  std::size_t operator()(const Corner& corner) const {
    std::uint64_t hash = 0x9E3779B97F4A7C15U;
    for (const double x : corner) {
      hash ^= std::bit_cast<std::uint64_t>(x);
      hash *= 0xFF51AFD7ED558CCDU;
      hash ^= hash >> 32;
    }
    return hash;
  }
};

class Welder {
 public:
  explicit Welder(std::size_t triangles) {
    index_of_.reserve(triangles / 2 + 8);
    coordinates_.reserve(3 * triangles / 2 + 24);
    mesh_.corner_vertices.reserve(3 * triangles);
    mesh_.polygon_start.reserve(triangles + 1);
    mesh_.polygon_start.push_back(0);
  }
  void corner(Corner corner) {
    for (double& x : corner) x += 0.0;  // -0 is the same place as 0
    const auto [entry, fresh] = index_of_.emplace(corner, static_cast<std::uint32_t>(index_of_.size()));
    if (fresh) coordinates_.insert(coordinates_.end(), corner.begin(), corner.end());
    mesh_.corner_vertices.push_back(entry->second);
  }
  void endTriangle() { mesh_.polygon_start.push_back(static_cast<std::uint32_t>(mesh_.corner_vertices.size())); }
  std::size_t vertexCount() const { return index_of_.size(); }
  std::size_t triangleCount() const { return mesh_.polygonCount(); }
  Mesh take() {
    mesh_.positions =
        Eigen::Map<const VertexPositions>(coordinates_.data(), static_cast<Eigen::Index>(index_of_.size()), 3);
    return std::move(mesh_);
  }

 private:
  std::unordered_map<Corner, std::uint32_t, CornerHash> index_of_;
  std::vector<double> coordinates_;
  Mesh mesh_;
};

Mesh parseBinary(std::string_view bytes, const std::string& name, std::size_t count) {
  if (count == 0) throw InputError(name + ": a mesh without faces; nothing can be rigged");
  if (count > kMaxPolygons)
    throw InputError(name + ": " + std::to_string(count) + " triangles, more than the limit of 2000000");
  Welder welder(count);
  for (std::size_t t = 0; t < count; ++t) {
    const std::size_t at = kHeaderBytes + t * kTriangleBytes + 12;  // after the normal
    for (std::size_t c = 0; c < 3; ++c) {
      Corner corner;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        float value;
        static_assert(std::endian::native == std::endian::little);
        std::memcpy(&value, bytes.data() + at + 12 * c + 4 * axis, sizeof value);
        if (!std::isfinite(value))
          throw InputError(name + ": @" + std::to_string(at + 12 * c + 4 * axis) + ": triangle " + std::to_string(t) +
                           " has a corner that is not finite");
        corner[axis] = static_cast<double>(value);
      }
      welder.corner(corner);
    }
    welder.endTriangle();
  }
  if (welder.vertexCount() > kMaxVertices)
    throw InputError(name + ": " + std::to_string(welder.vertexCount()) + " vertices, more than the limit of 1000000");
  Mesh mesh = welder.take();
  const std::size_t end = kHeaderBytes + count * kTriangleBytes;
  if (end < bytes.size())
    mesh.notes.push_back(name + ": @" + std::to_string(end) + ": " + std::to_string(bytes.size() - end) +
                         " bytes after the last triangle; passed over");
  return mesh;
}

class AsciiParser {
 public:
  AsciiParser(std::string_view text, const std::string& name) : text_(text, name), welder_(text.size() / 200) {}

  Mesh parse() {
    while (text_.nextWord()) {
      const std::string_view word = text_.word();
      if (word == "facet") {
        facet();
      } else if (word == "solid" || word == "endsolid" || word == "color") {
        text_.endLine();
      } else {
        text_.fail(inQuotes(word) + " where a facet was expected");
      }
    }
    if (welder_.triangleCount() == 0) text_.fail("a mesh without faces; nothing can be rigged");
    return welder_.take();
  }

 private:
  void expect(const char* keyword) {
    if (!text_.nextWord()) text_.fail(std::string("the file ends where '") + keyword + "' was expected");
    const std::string_view word = text_.word();
    if (word != keyword) text_.fail(inQuotes(word) + " where '" + keyword + "' was expected");
  }
  void facet() {
    if (welder_.triangleCount() == kMaxPolygons) text_.fail("more than 2000000 triangles");
    text_.endLine();  // the normal: many writers leave it wrong or zero, or nan, and the corners say it too
    expect("outer");
    expect("loop");
    for (int c = 0; c < 3; ++c) {
      expect("vertex");
      Corner corner;
      for (double& x : corner) {
        if (!text_.wordOnLine()) text_.fail("vertex has too few numbers");
        x = text_.number("vertex");
      }
      welder_.corner(corner);
    }
    if (welder_.vertexCount() > kMaxVertices) text_.fail("more than 1000000 vertices");
    expect("endloop");
    expect("endfacet");
    welder_.endTriangle();
  }

  TextScanner text_;
  Welder welder_;
};

}  // namespace

Mesh parseStl(std::string_view bytes, const std::string& name_for_errors) {
  // Binary files may begin with "solid" too: the size tells them.
  std::uint32_t count = 0;
  if (bytes.size() >= kHeaderBytes) std::memcpy(&count, bytes.data() + 80, sizeof count);
  const std::uint64_t binary_size = kHeaderBytes + std::uint64_t{count} * kTriangleBytes;
  const bool could_be_binary = bytes.size() >= kHeaderBytes;
  if (could_be_binary && bytes.size() == binary_size) return parseBinary(bytes, name_for_errors, count);
  const std::size_t first = bytes.find_first_not_of(" \t\r\n");
  if (first != bytes.npos && bytes.substr(first).starts_with("solid") && bytes.substr(0, 1024).find('\0') == bytes.npos)
    return AsciiParser(bytes, name_for_errors).parse();
  if (!could_be_binary)
    throw InputError(
        name_for_errors +
        ": neither an ASCII STL file, which begins with 'solid', nor a binary one, which has at least 84 bytes");
  if (bytes.size() < binary_size)
    throw InputError(name_for_errors + ": " + std::to_string(count) + " triangles need " + std::to_string(binary_size) +
                     " bytes, the file has " + std::to_string(bytes.size()) + "; it is cut, or no STL file");
  return parseBinary(bytes, name_for_errors, count);
}

}  // namespace volto::rig
