#include "rig/assets/head/strips.h"

#include "rig/assets/head/skin_field.h"

namespace volto::head {
namespace {

constexpr double kPi = 3.14159265358979323846;

// Piecewise linear or smooth table over equally spaced knots (Catmull-Rom).
template <std::size_t N>
double spline(const double (&knots)[N], double t) {
  t = t < 0 ? 0 : (t > static_cast<double>(N - 1) ? static_cast<double>(N - 1) : t);
  std::size_t i = static_cast<std::size_t>(t);
  if (i > N - 2) i = N - 2;
  const double f = t - static_cast<double>(i);
  const double p1 = knots[i], p2 = knots[i + 1];
  const double p0 = i > 0 ? knots[i - 1] : 2 * p1 - p2;
  const double p3 = i + 2 < N ? knots[i + 2] : 2 * p2 - p1;
  return p1 + 0.5 * f * (p2 - p0 + f * (2 * p0 - 5 * p1 + 4 * p2 - p3 + f * (3 * (p1 - p2) + p3 - p0)));
}

template <std::size_t N>
double wrappedSpline(const double (&knots)[N], double t) {
  const double n = static_cast<double>(N);
  t -= n * std::floor(t / n);
  std::size_t i = static_cast<std::size_t>(t);
  if (i >= N) i = 0;
  const double f = t - std::floor(t);
  const double p0 = knots[(i + N - 1) % N], p1 = knots[i], p2 = knots[(i + 1) % N], p3 = knots[(i + 2) % N];
  return p1 + 0.5 * f * (p2 - p0 + f * (2 * p0 - 5 * p1 + 4 * p2 - p3 + f * (3 * (p1 - p2) + p3 - p0)));
}

// --- Eye
// -------------------------------------------------------------------------------------------------------------------------

// Curves around the eye, relative to the eyeball's centre and seen from in front: 16 knots from the inner corner over
// the upper lid. The palpebral fissure; the crease of the upper lid and where the lower lid ends; the rim of the orbit.
constexpr double kFissureX[16] = {-1.50, -1.25, -0.88, -0.42, 0.05, 0.52,  0.94,  1.27,
                                  1.50,  1.28,  0.96,  0.54,  0.08, -0.40, -0.86, -1.24};
constexpr double kFissureY[16] = {-0.22, 0.10,  0.38,  0.54,  0.58,  0.55,  0.44,  0.28,
                                  0.06,  -0.24, -0.45, -0.58, -0.63, -0.60, -0.49, -0.34};
constexpr double kCreaseX[16] = {-1.67, -1.42, -0.98, -0.45, 0.06, 0.58,  1.08,  1.50,
                                 1.80,  1.60,  1.18,  0.65,  0.08, -0.48, -1.02, -1.44};
constexpr double kCreaseY[16] = {-0.20, 0.28,  0.68,  0.90,  0.97,  0.95,  0.82,  0.56,
                                 0.10,  -0.42, -0.82, -1.04, -1.10, -1.02, -0.80, -0.52};
constexpr double kOrbitX[16] = {-1.84, -1.68, -1.18, -0.52, 0.08, 0.66,  1.28,  1.82,
                                2.22,  2.02,  1.45,  0.76,  0.08, -0.60, -1.22, -1.66};
constexpr double kOrbitY[16] = {-0.20, 0.50,  1.08,  1.36,  1.45,  1.43,  1.27,  0.90,
                                0.15,  -0.78, -1.36, -1.62, -1.68, -1.58, -1.28, -0.80};

// On the skin, straight behind (x, y) relative to the eyeball's centre.
Vec3 lidSkin(double x, double y) {
  return castToSkin({kEyeCentre.x + x, kEyeCentre.y + y, 16}, {0, 0, -1}) - kEyeCentre;
}

Vec3 eyePoint(double ring, double around) {
  const double fx = wrappedSpline(kFissureX, around), fy = wrappedSpline(kFissureY, around);
  const double cx = wrappedSpline(kCreaseX, around), cy = wrappedSpline(kCreaseY, around);
  if (ring < kLidMarginFront) {
    if (ring < kLidCrease) {  // close to the crease the rings are close together
      const double t = 1 - std::pow(1 - clamp01(ring - kOrbit), 1.5);
      return kEyeCentre +
             lidSkin(lerp(wrappedSpline(kOrbitX, around), cx, t), lerp(wrappedSpline(kOrbitY, around), cy, t));
    }
    const double t = std::pow(ring - kLidCrease, 1.15);
    Vec3 p = lidSkin(lerp(cx, fx, t), lerp(cy, fy, t));
    // The crease itself is a line that goes in.
    const double upper = smoothstep(0.7, 2.2, around) * (1 - smoothstep(5.8, 7.5, around));
    p = p - normalized(p) * (0.05 * upper * smoothstep(0.2, 0.0, ring - kLidCrease));
    return kEyeCentre + p;
  }
  const Vec3 front = lidSkin(fx, fy);
  const double keep = kEyeRadius + kLidGap;
  const Vec3 back = normalized(front) * std::fmax(keep, length(front) - 1.15 * kLidThickness);
  if (ring <= kLidMarginBack) return kEyeCentre + lerp(front, back, ring - kLidMarginFront);
  // Behind the lids: along the eyeball, away from the opening's axis; in the corners down to the ball, in
  // the inner one a little towards the axis, as the caruncle does.
  const double phase = around / 8 - std::floor(around / 8);
  const double open = smoothstep(0.04, 0.22, std::fmin(phase, 1 - phase)), t = clamp01(ring - kLidMarginBack);
  const bool inner = around < 4 || around > 12;
  const double flat = std::sqrt(back.x * back.x + back.y * back.y);
  const double angle = std::atan2(flat, back.z) + lerp(inner ? -0.08 : 0.03, 0.36, open) * t;
  const double radius = lerp(length(back), keep + 0.03 * open, t);
  return kEyeCentre + Vec3{back.x / flat * std::sin(angle), back.y / flat * std::sin(angle), std::cos(angle)} *
                          std::fmax(keep, radius);
}

// --- Mouth
// -----------------------------------------------------------------------------------------------------------------------

constexpr double kMouthGap = 0.005;  // half of the hair's gap between the closed lips
// 11 knots from the middle of the upper lip over the corner to the middle of the lower lip.
constexpr double kBorderX[11] = {0.0, 0.46, 1.02, 1.60, 2.12, 2.50, 2.12, 1.62, 1.07, 0.53, 0.0};
constexpr double kBorderY[11] = {-5.98, -5.86, -5.98, -6.18, -6.36, -6.485, -6.85, -7.20, -7.42, -7.52, -7.54};
constexpr double kRimX[11] = {0.0, 0.48, 1.0, 1.52, 1.98, 2.34, 1.98, 1.52, 1.0, 0.48, 0.0};
constexpr double kRimY[11] = {-6.69, -6.64, -6.59, -6.60, -6.56, -6.49, -6.57, -6.60, -6.59, -6.64, -6.69};
constexpr double kRimBack[11] = {0.20, 0.21, 0.22, 0.22, 0.19, 0.15, 0.19, 0.22, 0.22, 0.20, 0.20};
constexpr double kFullness[11] = {0.42, 0.4, 0.35, 0.25, 0.11, 0.0, 0.11, 0.29, 0.42, 0.47, 0.49};

Vec3 lipBorder(double around) {
  const Vec3 p{spline(kBorderX, around), spline(kBorderY, around), 0};
  return castToSkin({p.x, p.y, 16}, {0, 0, -1});
}

Vec3 lipRim(double around) {
  const double side = around < 5 ? 1 : (around > 5 ? -1 : 0);
  const double x = spline(kRimX, around), y = spline(kRimY, around);
  const Vec3 skin = castToSkin({x, y, 16}, {0, 0, -1});
  const double part = clamp01(std::fabs(around - 5) / 0.5);
  return {x, y + side * part * kMouthGap, skin.z - spline(kRimBack, around)};
}

Vec3 mouthPoint(double ring, double around) {
  const Vec3 border = lipBorder(around), rim = lipRim(around);
  const double up = around < 5 ? 1 : (around > 5 ? -1 : 0);
  const double open = clamp01(std::fabs(around - 5) / 5);  // 0 at the corner, 1 in the middle
  if (ring <= kLipRim) {
    const double t = clamp01((ring - kLipBorder) / (kLipRim - kLipBorder));
    Vec3 bulge = lerp(border, rim, 0.55);
    bulge.z = (border.z > rim.z ? border.z : rim.z) + spline(kFullness, around);
    return border * ((1 - t) * (1 - t)) + bulge * (2 * t * (1 - t)) + rim * (t * t);
  }
  // The lips touch for a while, then open into the vestibule, the mouth and the throat.
  const double spread = std::pow(open * (2 - open), 0.3);
  const Vec3 contact{rim.x * 1.0, rim.y + up * 0.01 * open, rim.z - 0.30};
  if (ring <= kMouthVestibule) return lerp(rim, contact, clamp01(ring - kLipRim));
  const Vec3 middle{rim.x * 1.20, -6.66 + up * (0.10 + (up > 0 ? 1.35 : 1.80) * spread),
                    rim.z - (up > 0 ? 0.65 : 0.95) - 0.4 * (1 - open)};
  if (ring <= 6) return lerp(contact, middle, ring - kMouthVestibule);
  const Vec3 back{rim.x * 1.25, -6.75 + up * (0.12 + (up > 0 ? 1.4 : 1.9) * spread), 4.6 - 0.4 * spread};
  return lerp(middle, back, clamp01(ring - 6));
}

// --- Ear
// -------------------------------------------------------------------------------------------------------------------------

// The ear's outline in its own plane: back (a) and up (b) from the middle of the root; 12 knots from the front over the
// top.
constexpr double kOutlineA[12] = {-0.80, -0.72, -0.40, 0.50, 1.55, 2.10, 2.06, 1.75, 1.30, 0.62, -0.10, -0.62};
constexpr double kOutlineB[12] = {-0.25, 1.05, 2.25, 2.95, 2.62, 1.60, 0.20, -1.10, -2.15, -2.85, -2.62, -1.55};

Vec3 earPoint(double ring, double around) {
  const auto [origin, back, up, out] = earFrame();
  const double oa = wrappedSpline(kOutlineA, around), ob = wrappedSpline(kOutlineB, around);
  // The lobe leans in to the head.
  const auto at = [origin = origin, back = back, up = up, out = out](double a, double b, double h) {
    return origin + back * a + up * b + out * (h - 0.38 * smoothstep(-0.8, -2.8, b));
  };

  // How much of a free edge there is: none in front, where the ear grows out of the cheek.
  const double phase = 2 * kPi * around / kEarAround;
  const double free_edge = smoothstep(-0.80, -0.10, -std::cos(phase));
  const double ra = lerp(oa, 0.55 * oa - 0.25, free_edge), rb = lerp(ob, 0.78 * ob, free_edge);
  Vec3 root = at(ra, rb, 0);
  root = castToSkin({14, root.y, root.z}, {-1, 0, 0});
  const Vec3 cavity{0.05, -0.35, 0};
  const auto shrunk = [&](double s, double h) { return at(lerp(cavity.x, oa, s), lerp(cavity.y, ob, s), h); };

  const double lobe = smoothstep(-1.3, -2.2, ob);  // 1 in the lobe: no folds there
  // In front of the ear hole stands the tragus.
  const double tragus = std::exp(-4.0 * (ob + 0.45) * (ob + 0.45)) * (1 - free_edge);
  const double edge = lerp(0.60, 0.22, lobe);  // how far the free edge stands out from the root
  const Vec3 rings[8] = {
      root,  // 1 on the head
      lerp(lerp(root, shrunk(0.95, 0.2), 0.3), lerp(root, shrunk(0.93, edge - 0.14), 0.72), free_edge),   // 2 back
      lerp(shrunk(0.90, 0.22 + 0.25 * tragus), shrunk(1.0, edge), free_edge),                             // 3 edge
      lerp(shrunk(0.82, 0.30 + 0.42 * tragus), shrunk(0.93, edge + lerp(0.18, 0.10, lobe)), free_edge),   // 4 helix
      lerp(shrunk(0.68, 0.30 + 0.45 * tragus), shrunk(0.80, edge + lerp(-0.14, 0.12, lobe)), free_edge),  // 5 groove
      lerp(shrunk(0.58, 0.18 + 0.25 * tragus), shrunk(0.63, edge + lerp(0.06, 0.06, lobe)), free_edge),   // 6 antihelix
      lerp(shrunk(0.46, -0.10), shrunk(0.44, edge + lerp(-0.45, -0.10, lobe)), free_edge),  // 7 wall of the concha
      shrunk(0.24, -0.18),                                                                  // 8 floor
  };
  const double r = ring - kEarRoot;
  int i = static_cast<int>(r);
  i = i < 0 ? 0 : (i > 6 ? 6 : i);
  return lerp(rings[i], rings[i + 1], clamp01(r - i));
}

}  // namespace

int stripPeriod(Strip strip) {
  switch (strip) {
    case Strip::eye:
      return kEyeAround;
    case Strip::nostril:
      return kNostrilAround;
    case Strip::ear:
      return kEarAround;
    default:
      return 0;
  }
}

EarFrame earFrame() {
  const double flare = 0.30, tilt = 0.16;  // radians: out from the skull, and backward
  const double cf = std::cos(flare), sf = std::sin(flare), ct = std::cos(tilt), st = std::sin(tilt);
  const Vec3 back{sf, 0, -cf}, up{0, 1, 0};
  return {{7.12, -1.65, 0.35}, back * ct - up * st, up * ct + back * st, {cf, 0, sf}};
}

Vec3 lidMargin(double around) { return eyePoint(kLidMarginFront, around); }

Vec3 stripPoint(Strip strip, double ring, double around) {
  switch (strip) {
    case Strip::eye:
      return eyePoint(ring, around);
    case Strip::mouth: {
      Vec3 p = mouthPoint(ring, around);
      if (around <= 0 || around >= kMouthAround) p.x = 0;
      return p;
    }
    case Strip::nostril:  // stays on the skin until sinkNostrils
    case Strip::ear:
      return earPoint(ring, around);
    case Strip::none:
      break;
  }
  return {};
}

}  // namespace volto::head
