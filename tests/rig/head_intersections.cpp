#include "tests/rig/head_intersections.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <unordered_map>

namespace volto::head {
namespace {

constexpr double kTouch = 1e-9;

// Does the open segment a-b pass through the triangle's inside or border? A segment that lies in the plane does not.
bool passesThrough(const Vec3& a, const Vec3& b, const Vec3& p, const Vec3& q, const Vec3& r) {
  const Vec3 normal = cross(q - p, r - p);
  const double size = length(normal);
  if (size == 0) return false;
  const Vec3 n = normal * (1 / size);
  const double from = dot(a - p, n), to = dot(b - p, n);
  if (!((from > kTouch && to < -kTouch) || (from < -kTouch && to > kTouch))) return false;
  const Vec3 hit = a + (b - a) * (from / (from - to));
  return dot(cross(q - p, hit - p), n) >= 0 && dot(cross(r - q, hit - q), n) >= 0 && dot(cross(p - r, hit - r), n) >= 0;
}

}  // namespace

std::vector<std::pair<std::size_t, std::size_t>> crossingTriangles(const std::vector<Vec3>& at,
                                                                   const std::vector<Triangle>& triangles) {
  const auto vertex = [&](int v) -> const Vec3& { return at[static_cast<std::size_t>(v)]; };
  // Cells about as large as the triangles are on average.
  double edges = 0;
  for (const Triangle& t : triangles) edges += length(vertex(t[0]) - vertex(t[1]));
  const double cell = 2 * edges / static_cast<double>(std::max<std::size_t>(1, triangles.size()));
  const auto key = [](std::int64_t x, std::int64_t y, std::int64_t z) {
    constexpr std::int64_t kOffset = 1 << 20;
    return ((x + kOffset) << 42) ^ ((y + kOffset) << 21) ^ (z + kOffset);
  };
  struct Box {
    Vec3 low, high;
  };
  std::vector<Box> boxes;
  std::unordered_map<std::int64_t, std::vector<std::size_t>> grid;
  std::vector<std::pair<std::size_t, std::size_t>> found;
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    const Triangle& t = triangles[i];
    Box box{vertex(t[0]), vertex(t[0])};
    for (const int v : t) {
      const Vec3& p = vertex(v);
      box.low = {std::min(box.low.x, p.x), std::min(box.low.y, p.y), std::min(box.low.z, p.z)};
      box.high = {std::max(box.high.x, p.x), std::max(box.high.y, p.y), std::max(box.high.z, p.z)};
    }
    const auto cellOf = [&](double x) { return static_cast<std::int64_t>(std::floor(x / cell)); };
    std::vector<std::size_t> near;
    for (std::int64_t x = cellOf(box.low.x); x <= cellOf(box.high.x); ++x)
      for (std::int64_t y = cellOf(box.low.y); y <= cellOf(box.high.y); ++y)
        for (std::int64_t z = cellOf(box.low.z); z <= cellOf(box.high.z); ++z) {
          std::vector<std::size_t>& here = grid[key(x, y, z)];
          near.insert(near.end(), here.begin(), here.end());
          here.push_back(i);
        }
    std::sort(near.begin(), near.end());
    near.erase(std::unique(near.begin(), near.end()), near.end());
    for (const std::size_t j : near) {
      const Box& other = boxes[j];
      if (other.low.x > box.high.x || other.high.x < box.low.x || other.low.y > box.high.y ||
          other.high.y < box.low.y || other.low.z > box.high.z || other.high.z < box.low.z)
        continue;
      const Triangle& u = triangles[j];
      int shared = 0;
      for (const int a : t) shared += static_cast<int>(std::count(u.begin(), u.end(), a));
      bool crosses = false;
      if (shared == 3) {
        crosses = true;
      } else if (shared == 2) {
        const auto normal = [&](const Triangle& w) {
          return normalized(cross(vertex(w[1]) - vertex(w[0]), vertex(w[2]) - vertex(w[0])));
        };
        crosses = dot(normal(t), normal(u)) < -0.99985;
      } else {
        // Edges that start in a shared vertex only touch there, unless they run through the inside, which the other
        // triangle's opposite edge then shows.
        const auto edgesCross = [&](const Triangle& of, const Triangle& through) {
          for (std::size_t k = 0; k < 3; ++k) {
            const int a = of[k], b = of[(k + 1) % 3];
            if (std::count(through.begin(), through.end(), a) + std::count(through.begin(), through.end(), b) > 0)
              continue;
            if (passesThrough(vertex(a), vertex(b), vertex(through[0]), vertex(through[1]), vertex(through[2])))
              return true;
          }
          return false;
        };
        crosses = edgesCross(t, u) || edgesCross(u, t);
      }
      if (crosses) found.emplace_back(j, i);
    }
    boxes.push_back(box);
  }
  return found;
}

}  // namespace volto::head
