#include "rig/obj_series.h"

#include <array>
#include <charconv>
#include <cstdint>
#include <optional>

#include "rig/file_bytes.h"
#include "rig/mesh_io.h"
#include "rig/mesh_limits.h"

namespace volto::rig {
namespace {

constexpr std::array<double, 19> kPowersOfTen = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8, 1e9,
                                                 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18};

bool isDigit(char c) { return c >= '0' && c <= '9'; }

// " -12.5". A double holds 15 digits exactly, and the power of ten: their quotient is the nearest double, as
// std::from_chars, which reads longer numbers, has it. Nothing for any other way to write a number.
std::optional<double> plainNumber(const char*& at, const char* end) {
  if (at == end || *at != ' ') return {};
  const char* p = at + 1;
  const bool negative = p < end && *p == '-';
  if (negative) ++p;
  std::uint64_t mantissa = 0;
  const char* const first = p;
  while (p < end && isDigit(*p)) mantissa = 10 * mantissa + static_cast<std::uint64_t>(*p++ - '0');
  auto digits = p - first;
  std::size_t behind_point = 0;
  if (p < end && *p == '.') {
    const char* const point = ++p;
    while (p < end && isDigit(*p)) mantissa = 10 * mantissa + static_cast<std::uint64_t>(*p++ - '0');
    behind_point = static_cast<std::size_t>(p - point);
    digits += p - point;
  }
  if (digits == 0 || (p < end && *p != ' ' && *p != '\n')) return {};
  at = p;
  if (digits > 15) {
    double value = 0;
    const auto [stop, error] = std::from_chars(first, p, value);
    if (error != std::errc() || stop != p) return {};
    return negative ? -value : value;
  }
  const double value = static_cast<double>(mantissa) / kPowersOfTen[behind_point];
  return negative ? -value : value;
}

// Comments and empty lines before the first vertex; the number of bytes.
std::size_t commentsBefore(std::string_view text) {
  std::size_t at = 0;
  while (at < text.size() && (text[at] == '#' || text[at] == '\n')) {
    const std::size_t end = text.find('\n', at);
    // A backslash at its end would join the next line to a comment.
    if (end == text.npos || (end > at && (text[end - 1] == '\\' || text[end - 1] == '\r'))) return 0;
    if (end - at > 1000) return 0;
    at = end + 1;
  }
  return at;
}

// `count` lines "v x y z" at the start of `text`; false for anything else, and when more vertices follow. `length`: of
// those lines.
bool plainVertices(std::string_view text, VertexPositions& out, std::size_t& length) {
  const char* at = text.data();
  const char* const end = at + text.size();
  double* coordinate = out.data();
  for (Eigen::Index v = 0; v < out.rows(); ++v) {
    if (at == end || *at != 'v') return false;
    ++at;
    for (int axis = 0; axis < 3; ++axis) {
      const auto x = plainNumber(at, end);
      if (!x) return false;
      *coordinate++ = *x;
    }
    if (at == end || *at != '\n') return false;
    ++at;
  }
  length = static_cast<std::size_t>(at - text.data());
  return at == end || *at != 'v' || (at + 1 < end && *(at + 1) != ' ');
}

}  // namespace

VertexPositions ObjSeries::read(const std::filesystem::path& path) {
  const std::string extension = path.extension().string();
  std::string bytes;
  std::size_t rest = 0;
  if (extension == ".obj" || extension == ".OBJ") {
    bytes = readFileBytes(path, kMaxMeshFileBytes);
    const std::size_t start = commentsBefore(bytes);
    VertexPositions positions(neutral_.positions.rows(), 3);
    std::size_t length = 0;
    if (plainVertices(std::string_view(bytes).substr(start), positions, length)) {
      rest = start + length;
      const std::lock_guard lock(mutex_);
      // What follows the same number of vertices and was accepted once says the same again.
      if (!rest_.empty() && std::string_view(bytes).substr(rest) == rest_) {
        ++short_reads_;
        return positions;
      }
    }
  }
  Mesh mesh = readMesh(path);
  requireSameTopology(neutral_, mesh, path.string());
  if (rest > 0 && rest < bytes.size()) {
    const std::lock_guard lock(mutex_);
    if (rest_.empty()) rest_ = bytes.substr(rest);
  }
  return std::move(mesh.positions);
}

}  // namespace volto::rig
