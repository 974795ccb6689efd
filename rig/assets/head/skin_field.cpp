#include "rig/assets/head/skin_field.h"

#include <algorithm>
#include <iterator>

namespace volto::head {
namespace {

// Polynomial smooth minimum (Quilez): k is the width of the blend in centimetres.
double melt(double a, double b, double k) {
  const double h = k - std::fabs(a - b);
  const double smaller = a < b ? a : b;
  return h > 0 ? smaller - h * h * h / (6 * k * k) : smaller;
}
double carve(double a, double b, double k) { return -melt(-a, b, k); }  // a without b

double ellipsoid(const Vec3& p, const Vec3& c, const Vec3& r) {
  const Vec3 q = p - c;
  const double k0 = length({q.x / r.x, q.y / r.y, q.z / r.z});
  const double k1 = length({q.x / (r.x * r.x), q.y / (r.y * r.y), q.z / (r.z * r.z)});
  return k1 > 1e-9 ? k0 * (k0 - 1) / k1 : -r.x;
}

// The middle of the fold of skin over the upper lid, relative to the eyeball's centre.
constexpr Vec3 kLidFold[] = {{-1.42, 0.42, 0.85}, {-0.85, 1.02, 1.10}, {-0.10, 1.29, 1.12},
                             {0.65, 1.28, 0.98},  {1.30, 1.03, 0.62},  {1.85, 0.62, 0.05}};
constexpr double kFoldRadius[] = {0.22, 0.30, 0.30, 0.30, 0.30, 0.20};

double sphere(const Vec3& p, const Vec3& c, double r) { return length(p - c) - r; }

// A capsule whose radius runs linearly from ra to rb.
double limb(const Vec3& p, const Vec3& a, double ra, const Vec3& b, double rb) {
  const Vec3 ab = b - a;
  const double t = clamp01(dot(p - a, ab) / dot(ab, ab));
  return length(p - (a + ab * t)) - lerp(ra, rb, t);
}

// Soft bump of height 1 and the given widths about a point or about a segment.
double bump(const Vec3& p, const Vec3& c, const Vec3& w) {
  const Vec3 q = p - c;
  const double s = q.x * q.x / (w.x * w.x) + q.y * q.y / (w.y * w.y) + q.z * q.z / (w.z * w.z);
  if (s >= 6.25) return 0;
  const double t = 1 - s / 6.25;
  return t * t * t * t;
}
double ridge(const Vec3& p, const Vec3& a, const Vec3& b, double width) {
  const Vec3 ab = b - a;
  const double t = clamp01(dot(p - a, ab) / dot(ab, ab));
  const Vec3 q = p - (a + ab * t);
  const double s = dot(q, q) / (width * width);
  if (s >= 6.25) return 0;
  const double u = 1 - s / 6.25;
  return u * u * u * u;
}

}  // namespace

double skinDistance(const Vec3& point) {
  const Vec3 p{std::fabs(point.x), point.y, point.z};
  const Vec3 m{std::sqrt(p.x * p.x + 0.02), p.y,
               p.z};  // rounded |x|: no crease at the midline for parts that stand beside it

  // Skull, forehead, temples.
  double d = ellipsoid(p, {0, 3.2, -0.9}, {7.4, 8.0, 8.9});
  d = melt(d, ellipsoid(p, {0, 4.0, 1.9}, {6.6, 5.6, 7.1}), 2.0);
  d = melt(d, ellipsoid(m, {3.8, 0.4, 3.5}, {2.6, 3.6, 3.3}), 2.2);
  // Face: maxilla, cheek bones, cheeks, jaw.
  d = melt(d, ellipsoid(p, {0, -3.2, 2.7}, {5.5, 6.6, 6.2}), 1.8);
  d = melt(d, ellipsoid(m, {3.55, -2.35, 5.5}, {2.3, 1.9, 2.15}), 2.2);
  d = melt(d, limb(m, {4.7, -1.8, 4.2}, 1.15, {5.95, -0.9, 0.6}, 0.9), 2.2);
  d = melt(d, ellipsoid(m, {2.9, -5.2, 4.8}, {2.6, 3.2, 2.75}), 2.4);
  d = melt(d, limb(m, {3.85, -6.55, 2.2}, 1.0, {1.0, -9.3, 6.9}, 1.2), 2.4);
  d = melt(d, limb(m, {5.35, -2.0, 0.8}, 0.95, {3.85, -6.55, 2.2}, 1.0), 2.4);
  d = melt(d, ellipsoid(p, {0, -9.45, 7.85}, {1.55, 1.3, 1.75}), 1.8);
  d = melt(d, ellipsoid(p, {0, -8.9, 3.4}, {2.6, 1.65, 4.2}), 1.8);
  // Muzzle: the teeth behind the lips.
  d = melt(d, ellipsoid(p, {0, -6.5, 6.9}, {3.3, 2.8, 2.85}), 2.2);
  d = melt(d, ellipsoid(m, {1.4, -3.8, 7.6}, {1.5, 2.0, 1.40}), 1.8);
  // Neck.
  d = melt(d, limb(p, {0, -4.0, -2.4}, 4.3, {0, -19.5, -3.2}, 4.8), 3.0);
  d = melt(d, limb(m, {4.2, -5.0, -2.5}, 0.7, {1.0, -18.5, 1.5}, 0.75), 2.2);
  d = melt(d, limb(m, {2.2, -13.5, -4.0}, 2.0, {5.0, -20.5, -3.8}, 2.2), 2.6);
  d = melt(d, ellipsoid(p, {0, -13.4, 1.4}, {0.8, 1.3, 0.75}), 1.6);

  // Orbits and brow ridge.
  d = carve(d, ellipsoid(m, {3.0, 0.10, 9.15}, {1.65, 1.10, 1.20}), 1.3);
  d = melt(d, limb(m, {0.8, 2.2, 8.10}, 0.6, {3.2, 2.45, 7.68}, 0.62), 1.7);
  d = melt(d, limb(m, {3.2, 2.45, 7.68}, 0.62, {5.1, 1.15, 5.6}, 0.55), 2.0);
  d = melt(d, ellipsoid(m, {3.2, -1.80, 6.55}, {1.8, 1.1, 1.40}), 1.6);

  // Nose: bridge, tip, wings, columella.
  double nose = limb(p, {0, 0.7, 8.3}, 0.50, {0, -1.5, 9.3}, 0.52);
  nose = melt(nose, limb(p, {0, -1.5, 9.3}, 0.52, {0, -3.0, 10.3}, 0.56), 0.3);
  nose = melt(nose, limb(m, {0.5, 0.4, 7.8}, 0.42, {0.85, -3.1, 9.0}, 0.52), 0.9);
  nose = melt(nose, ellipsoid(p, {0, -3.36, 10.40}, {0.92, 0.74, 0.78}), 0.6);
  nose = melt(nose, ellipsoid(m, {1.00, -3.80, 9.45}, {0.56, 0.60, 0.90}), 0.8);
  nose = melt(nose, limb(p, {0, -3.9, 10.3}, 0.40, {0, -4.42, 9.5}, 0.46), 0.6);
  nose = melt(nose, ellipsoid(p, {0, 1.45, 8.05}, {0.72, 1.2, 0.88}), 0.9);  // up into the forehead
  d = melt(d, nose, 0.9);

  // The skin that folds over the upper lid, and the lids: they lie on a sphere a little larger than the eyeball. The
  // upper one meets the fold sharply, in the crease; the lower one runs out into the cheek.
  if (p.z > 6.0) {
    for (std::size_t i = 0; i + 1 < std::size(kLidFold); ++i)
      d = melt(d, limb(p, kEyeCentre + kLidFold[i], kFoldRadius[i], kEyeCentre + kLidFold[i + 1], kFoldRadius[i + 1]),
               0.8);
    const double upper = smoothstep(-0.1, 0.35, p.y - 0.1 * (p.x - kEyeCentre.x));
    d = melt(d, sphere({m.x, p.y, p.z}, kEyeCentre, kEyeRadius + kLidThickness), lerp(0.5, 0.10, upper));
  }

  // Sculpting: + digs in, - builds up.
  d += 0.09 * bump(p, {0, -5.15, 10.0}, {0.26, 0.6, 0.9});            // philtrum
  d += 0.10 * ridge(p, {1.70, -3.4, 9.4}, {1.66, -4.30, 9.3}, 0.24);  // groove behind the nose wing
  d += 0.06 * ridge(p, {1.95, -4.3, 9.2}, {3.1, -6.2, 8.4}, 0.6);     // nasolabial fold
  d += 0.16 * bump(p, {0, -8.45, 9.5}, {1.6, 0.45, 1.2});             // under the lower lip
  d += 0.12 * bump(p, {5.9, 2.8, 5.0}, {1.2, 2.2, 2.2});              // temple
  return d;
}

Vec3 skinGradient(const Vec3& p) {
  constexpr double kStep = 1e-4;
  const double gx = skinDistance({p.x + kStep, p.y, p.z}) - skinDistance({p.x - kStep, p.y, p.z});
  const double gy = skinDistance({p.x, p.y + kStep, p.z}) - skinDistance({p.x, p.y - kStep, p.z});
  const double gz = skinDistance({p.x, p.y, p.z + kStep}) - skinDistance({p.x, p.y, p.z - kStep});
  return Vec3{gx, gy, gz} * (0.5 / kStep);
}

Vec3 projectToSkin(Vec3 p) {
  const bool midline = p.x == 0;
  for (int i = 0; i < 6; ++i) {
    const double d = skinDistance(p);
    if (std::fabs(d) < 1e-7) break;
    Vec3 g = skinGradient(p);
    if (midline) g.x = 0;
    const double gg = dot(g, g);
    if (gg < 1e-6) break;
    double step = d / gg;
    const double far = 0.5 / std::sqrt(gg);  // never further than half a centimetre at once
    step = step > far ? far : (step < -far ? -far : step);
    p = p - g * step;
  }
  if (midline) p.x = 0;
  return p;
}

Vec3 castToSkin(const Vec3& origin, const Vec3& direction) {
  const Vec3 n = normalized(direction);
  double t = 0, inside = -1, outside = 0;
  for (int i = 0; i < 400; ++i) {
    const double d = skinDistance(origin + n * t);
    if (d < 0) {
      inside = t;
      break;
    }
    outside = t;
    t += 0.6 * d + 1e-3;
    if (t > 60) break;
  }
  if (inside < 0) return origin + n * outside;
  for (int i = 0; i < 40; ++i) {
    const double mid = 0.5 * (inside + outside);
    (skinDistance(origin + n * mid) < 0 ? inside : outside) = mid;
  }
  return origin + n * outside;
}

}  // namespace volto::head
