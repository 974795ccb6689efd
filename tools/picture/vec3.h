// Three floats and the few operations that drawing needs.
#pragma once

#include <cmath>

namespace volto::picture {

struct Vec3 {
  float x = 0.0F, y = 0.0F, z = 0.0F;
};

constexpr Vec3 operator+(Vec3 a, Vec3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
constexpr Vec3 operator-(Vec3 a, Vec3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
constexpr Vec3 operator-(Vec3 a) { return {-a.x, -a.y, -a.z}; }
constexpr Vec3 operator*(Vec3 a, float s) { return {a.x * s, a.y * s, a.z * s}; }
constexpr Vec3 operator*(Vec3 a, Vec3 b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }
constexpr float dot(Vec3 a, Vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
constexpr Vec3 cross(Vec3 a, Vec3 b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
constexpr Vec3 mix(Vec3 a, Vec3 b, float t) { return a + (b - a) * t; }
inline float length(Vec3 a) { return std::sqrt(dot(a, a)); }
// The zero vector stays zero.
inline Vec3 normalised(Vec3 a) {
  const float size = length(a);
  return size > 0.0F ? a * (1.0F / size) : Vec3{};
}

// Rows of a 3 by 3 matrix.
struct Mat3 {
  Vec3 row_x{1, 0, 0}, row_y{0, 1, 0}, row_z{0, 0, 1};
};
constexpr Vec3 operator*(const Mat3& m, Vec3 v) { return {dot(m.row_x, v), dot(m.row_y, v), dot(m.row_z, v)}; }
constexpr Mat3 operator*(const Mat3& a, const Mat3& b) {
  const Vec3 cx{b.row_x.x, b.row_y.x, b.row_z.x}, cy{b.row_x.y, b.row_y.y, b.row_z.y},
      cz{b.row_x.z, b.row_y.z, b.row_z.z};
  return {{dot(a.row_x, cx), dot(a.row_x, cy), dot(a.row_x, cz)},
          {dot(a.row_y, cx), dot(a.row_y, cy), dot(a.row_y, cz)},
          {dot(a.row_z, cx), dot(a.row_z, cy), dot(a.row_z, cz)}};
}

}  // namespace volto::picture
