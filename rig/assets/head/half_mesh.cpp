#include "rig/assets/head/half_mesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <unordered_map>

#include "rig/assets/head/skin_field.h"

namespace volto::head {
namespace {

// Cells of the grid around the left half: columns from the face's midline to the nape's, rows from crown to neck.
constexpr int kColumns = 14, kRows = 20;
// Blocks of the grid that are filled with rings: first row and column, last row and column of their outline.
constexpr int kEyeTop = 3, kEyeBottom = 7, kEyeInner = 3, kEyeOuter = 7;
constexpr int kMouthTop = 12, kMouthBottom = 14, kMouthOuter = 4;
constexpr int kNostrilRow = 10, kNostrilColumn = 1;
constexpr int kEarTop = 4, kEarBottom = 8, kEarFront = 9, kEarBehind = 11;

constexpr double kPi = 3.14159265358979323846;

// Height in front, at the ear and at the nape, and the pitch of the rays in front (degrees) under the chin.
struct Row {
  double front, side, behind, pitch;
};
constexpr std::array<Row, kRows + 1> kRowTable{{
    {8.7, 8.7, 8.7, 0},                                   // crown
    {6.5, 6.2, 5.8, 0},                                   // hair line
    {4.2, 3.6, 3.0, 0},                                   // forehead
    {2.10, 2.10, 0.9, 0},                                 // brows: top of the eye block
    {1.05, 1.20, -0.2, 0},                                // ear block begins
    {-0.05, -0.55, -1.3, 0},                              // corners of the eyes
    {-1.0, -1.85, -2.3, 0},     {-1.95, -3.05, -3.3, 0},  // bottom of the eye block
    {-2.75, -4.65, -4.5, 0},                              // above the tip of the nose, end of the ear block
    {-3.45, -5.2, -5.2, 0},                               // tip of the nose
    {-4.08, -5.6, -5.8, 0},                               // nostril
    {-4.58, -5.8, -6.5, 0},                               // base of the nose
    {-5.2, -6.2, -7.2, 0},                                // top of the mouth block
    {-6.15, -6.6, -8.2, 0},                               // corners of the mouth
    {-8.5, -7.7, -9.2, 0},                                // bottom of the mouth block
    {-9.9, -8.7, -10.2, 0},                               // chin
    {-11.0, -9.8, -11.2, 0},                              // bottom of the chin
    {-11.7, -10.8, -12.2, -25}, {-12.5, -12.0, -13.3, -25}, {-14.8, -14.6, -15.1, 0}, {-17.6, -17.6, -17.6, 0},
}};

// Columns: angle about the vertical axis in degrees (0 straight ahead), for some rows; rows between are interpolated.
struct ColumnAngles {
  int row;
  std::array<double, kColumns + 1> degrees;
};
constexpr std::array<ColumnAngles, 10> kColumnTable{{
    {0, {0, 9, 18, 27, 37, 48, 59, 71, 83, 95, 107, 119, 139, 159, 180}},
    {1, {0, 4.5, 9, 14, 19.5, 26, 34, 46, 64, 82, 95, 109, 132, 156, 180}},
    {3, {0, 2.3, 4.7, 7.4, 14.0, 20.3, 27, 37, 59, 82, 95, 109, 132, 156, 180}},
    {7, {0, 2.3, 4.9, 7.8, 14.2, 20.8, 28, 38, 58, 82, 95, 109, 132, 156, 180}},
    {8, {0, 2.2, 4.9, 9.4, 15.5, 22, 30, 40.5, 59, 82, 95, 109, 132, 156, 180}},
    {9, {0, 2.2, 5.6, 10.2, 16.0, 23, 32, 42, 60, 82, 95, 109, 132, 156, 180}},
    {10, {0, 1.7, 6.4, 10.6, 16.3, 23.7, 33, 44, 61, 82, 95, 109, 132, 156, 180}},
    {13, {0, 4.4, 9.6, 15.6, 21.8, 29, 37, 47, 63, 83, 96, 109, 132, 156, 180}},
    {16, {0, 3.6, 8, 12.5, 18, 25, 33, 44, 62, 83, 96, 110, 132, 156, 180}},
    {20, {0, 12.8, 25.7, 38.5, 51.4, 64.3, 77, 90, 102, 115, 128, 141, 154, 167, 180}},
}};

constexpr Vec3 kNostril{0.68, -4.36, 9.9}, kNostrilInward{-0.05, 0.85, -0.50};

double columnAngle(int row, int column) {
  std::size_t k = 0;
  while (k + 2 < kColumnTable.size() && kColumnTable[k + 1].row <= row) ++k;
  const ColumnAngles &a = kColumnTable[k], &b = kColumnTable[k + 1];
  const double t = clamp01(static_cast<double>(row - a.row) / (b.row - a.row));
  const auto c = static_cast<std::size_t>(column);
  return lerp(a.degrees[c], b.degrees[c], t) * (kPi / 180);
}

Vec3 gridPoint(int row, int column) {
  const Row& r = kRowTable[static_cast<std::size_t>(row)];
  const double angle = columnAngle(row, column), degrees = angle * (180 / kPi);
  // Height: the front's as far as the cheek, then over to the ear's, then to the nape's.
  double y = lerp(r.front, r.side, smoothstep(18, 75, degrees));
  y = lerp(y, r.behind, smoothstep(100, 175, degrees));
  const double axis_z = r.pitch != 0 || row > kRows - 2 ? -1.5 : 0;
  const double pitch = r.pitch * (kPi / 180) * (1 - smoothstep(40, 110, degrees));
  const Vec3 level{std::sin(angle), 0, std::cos(angle)};
  const Vec3 direction = level * std::cos(pitch) + Vec3{0, std::sin(pitch), 0};
  Vec3 origin{0, y, axis_z};
  if (r.pitch != 0) origin.y = y + 7.5 * std::sin(-pitch);
  Vec3 p = castToSkin(origin + direction * 24, direction * -1);
  if (column == 0 || column == kColumns) p.x = 0;
  return p;
}

class CageBuilder {
 public:
  HalfMesh build() {
    makeGrid();
    makeCrown();
    makeEye();
    makeMouth();
    makeNostril();
    makeEar();
    return std::move(mesh_);
  }

 private:
  int add(HalfVertex v) {
    mesh_.vertices.push_back(v);
    return static_cast<int>(mesh_.vertices.size()) - 1;
  }
  int addSkin(const Vec3& p, bool midline) {
    HalfVertex v;
    v.position = p;
    v.midline = midline;
    return add(v);
  }
  int addStrip(Strip strip, double ring, double around, bool midline = false) {
    HalfVertex v;
    v.hold = Hold::strip;
    v.strip = strip;
    v.ring = ring;
    v.around = around;
    v.midline = midline;
    v.position = stripPoint(strip, ring, around);
    return add(v);
  }
  void addPolygon(std::vector<int> corners, Material material) {
    mesh_.polygons.push_back({std::move(corners), material, {}});
  }
  int& grid(int row, int column) { return grid_[static_cast<std::size_t>(row)][static_cast<std::size_t>(column)]; }
  const Vec3& at(int v) const { return mesh_.vertices[static_cast<std::size_t>(v)].position; }

  static bool inEye(int r, int c) { return r >= kEyeTop && r < kEyeBottom && c >= kEyeInner && c < kEyeOuter; }
  static bool inMouth(int r, int c) { return r >= kMouthTop && r < kMouthBottom && c < kMouthOuter; }
  static bool inNostril(int r, int c) { return r == kNostrilRow && c == kNostrilColumn; }
  static bool inEar(int r, int c) { return r >= kEarTop && r < kEarBottom && c >= kEarFront && c < kEarBehind; }
  // Close-cropped hair: over the forehead, down before and behind the ear, to the nape.
  static Material gridMaterial(int r, int c) {
    const bool hair = r < 1 || (r == 1 && c >= 7) || (r >= 2 && r <= 5 && c >= kEarFront - 1) ||
                      (r <= kEarBottom + 1 && c >= kEarBehind);
    return hair ? Material::hair : Material::skin;
  }
  // Strictly inside a block: no grid vertex there.
  static bool insideBlock(int r, int c) {
    return (r > kEyeTop && r < kEyeBottom && c > kEyeInner && c < kEyeOuter) ||
           (r > kMouthTop && r < kMouthBottom && c < kMouthOuter) ||
           (r > kEarTop && r < kEarBottom && c > kEarFront && c < kEarBehind);
  }

  void makeGrid() {
    for (int r = 0; r <= kRows; ++r)
      for (int c = 0; c <= kColumns; ++c) {
        grid(r, c) = -1;
        if (insideBlock(r, c)) continue;
        grid(r, c) = addSkin(gridPoint(r, c), c == 0 || c == kColumns);
        mesh_.vertices.back().border = r == kRows;
      }
    for (int r = 0; r < kRows; ++r)
      for (int c = 0; c < kColumns; ++c)
        if (!inEye(r, c) && !inMouth(r, c) && !inNostril(r, c) && !inEar(r, c))
          addPolygon({grid(r, c), grid(r + 1, c), grid(r + 1, c + 1), grid(r, c + 1)}, gridMaterial(r, c));
  }

  // The uppermost row closed by a patch of quads: 3 to the side, the others from front to back.
  void makeCrown() {
    constexpr int kAcross = 3, kAlong = kColumns - 2 * kAcross;
    std::array<std::array<int, kAcross + 1>, kAlong + 1> cap{};
    for (int a = 0; a <= kAlong; ++a)
      for (int s = 0; s <= kAcross; ++s) {
        int v = -1;
        if (a == 0)
          v = grid(0, s);
        else if (a == kAlong)
          v = grid(0, kColumns - s);
        else if (s == kAcross)
          v = grid(0, kAcross + a);
        else {
          const Vec3 rim = at(grid(0, kAcross + a));
          const double t = static_cast<double>(s) / kAcross;
          const Vec3 front = at(grid(0, s)), back = at(grid(0, kColumns - s));
          const double f = static_cast<double>(a) / kAlong;
          const Vec3 flat{lerp(rim.x * t, lerp(front.x, back.x, f), 0.3), 0,
                          lerp(rim.z, lerp(front.z, back.z, f), 0.6)};
          Vec3 p = castToSkin({flat.x, 20, flat.z}, {0, -1, 0});
          if (s == 0) p.x = 0;
          v = addSkin(p, s == 0);
        }
        cap[static_cast<std::size_t>(a)][static_cast<std::size_t>(s)] = v;
      }
    for (std::size_t a = 0; a < kAlong; ++a)
      for (std::size_t s = 0; s < kAcross; ++s)
        addPolygon({cap[a][s], cap[a][s + 1], cap[a + 1][s + 1], cap[a + 1][s]}, Material::hair);
    // (Seen from above the front row comes first and the side grows to the left: counter-clockwise is front, side,
    // back.)
  }

  // Quads between an outer ring and the next ring inward, both clockwise seen from outside.
  void joinRings(const std::vector<int>& outer, const std::vector<int>& inner, bool closed, Material material) {
    const std::size_t n = outer.size(), count = closed ? n : n - 1;
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t j = (i + 1) % n;
      addPolygon({outer[i], inner[i], inner[j], outer[j]}, material);
    }
  }

  // A free ring between a block's outline and the first ring that is held by its strip; it keeps strip coordinates all
  // the same.
  std::vector<int> skinRing(const std::vector<int>& block, Strip strip, double held, double ring, double t, bool open) {
    std::vector<int> out;
    for (std::size_t i = 0; i < block.size(); ++i) {
      const Vec3 inner = stripPoint(strip, held, static_cast<double>(i));
      const bool midline = open && (i == 0 || i + 1 == block.size());
      Vec3 p = lerp(at(block[i]), inner, t);
      if (midline) p.x = 0;
      out.push_back(addSkin(projectToSkin(p), midline));
      mesh_.vertices.back().strip = strip;
      mesh_.vertices.back().ring = ring;
      mesh_.vertices.back().around = static_cast<double>(i);
    }
    return out;
  }
  std::vector<int> stripRing(Strip strip, double ring, int count, bool open) {
    std::vector<int> out;
    for (int i = 0; i < count; ++i) out.push_back(addStrip(strip, ring, i, open && (i == 0 || i + 1 == count)));
    return out;
  }

  void makeEye() {
    std::vector<int> block;
    constexpr int kMiddle = (kEyeTop + kEyeBottom) / 2;
    for (int r = kMiddle; r > kEyeTop; --r) block.push_back(grid(r, kEyeInner));
    for (int c = kEyeInner; c < kEyeOuter; ++c) block.push_back(grid(kEyeTop, c));
    for (int r = kEyeTop; r < kEyeBottom; ++r) block.push_back(grid(r, kEyeOuter));
    for (int c = kEyeOuter; c > kEyeInner; --c) block.push_back(grid(kEyeBottom, c));
    for (int r = kEyeBottom; r > kMiddle; --r) block.push_back(grid(r, kEyeInner));
    const auto orbit = stripRing(Strip::eye, kOrbit, kEyeAround, false);
    const auto fold = stripRing(Strip::eye, kLidCrease, kEyeAround, false);
    const auto front = stripRing(Strip::eye, kLidMarginFront, kEyeAround, false);
    const auto back = stripRing(Strip::eye, kLidMarginBack, kEyeAround, false);
    const auto pocket = stripRing(Strip::eye, kLidPocket, kEyeAround, false);
    joinRings(block, orbit, true, Material::skin);
    joinRings(orbit, fold, true, Material::skin);
    joinRings(fold, front, true, Material::skin);
    joinRings(front, back, true, Material::caruncle);
    joinRings(back, pocket, true, Material::caruncle);
  }

  void makeMouth() {
    std::vector<int> block;
    for (int c = 0; c < kMouthOuter; ++c) block.push_back(grid(kMouthTop, c));
    for (int r = kMouthTop; r < kMouthBottom; ++r) block.push_back(grid(r, kMouthOuter));
    for (int c = kMouthOuter; c >= 0; --c) block.push_back(grid(kMouthBottom, c));
    const auto around = skinRing(block, Strip::mouth, kLipBorder, 1, 0.55, true);
    std::vector<std::vector<int>> rings;
    for (double ring = kLipBorder; ring <= kMouthBack; ring += 1)
      rings.push_back(stripRing(Strip::mouth, ring, kMouthAround + 1, true));
    joinRings(block, around, false, Material::skin);
    joinRings(around, rings[0], false, Material::skin);
    joinRings(rings[0], rings[1], false, Material::lips);
    joinRings(rings[1], rings[2], false, Material::lips);
    for (std::size_t k = 2; k + 1 < rings.size(); ++k) joinRings(rings[k], rings[k + 1], false, Material::mouth);
    const auto& back = rings.back();  // closed at the throat: upper half to lower half
    for (std::size_t i = 0; i < 4; ++i) addPolygon({back[i], back[10 - i], back[9 - i], back[i + 1]}, Material::mouth);
    addPolygon({back[4], back[6], back[5]}, Material::mouth);
  }

  void makeNostril() {
    const std::vector<int> block{grid(kNostrilRow, kNostrilColumn), grid(kNostrilRow, kNostrilColumn + 1),
                                 grid(kNostrilRow + 1, kNostrilColumn + 1), grid(kNostrilRow + 1, kNostrilColumn)};
    for (std::size_t i = 0; i < block.size(); ++i) {
      HalfVertex& v = mesh_.vertices[static_cast<std::size_t>(block[i])];
      v.strip = Strip::nostril;
      v.around = static_cast<double>(i);
    }
    std::vector<std::vector<int>> rings{block};
    for (const double t : {0.13, 0.25, 0.40, 0.65}) {
      std::vector<int> ring;
      for (std::size_t i = 0; i < block.size(); ++i) {
        ring.push_back(addSkin(
            projectToSkin(lerp(at(block[i]), castToSkin(kNostril - kNostrilInward * 1.1, kNostrilInward), t)), false));
        mesh_.vertices.back().strip = Strip::nostril;
        mesh_.vertices.back().ring = static_cast<double>(rings.size());
        mesh_.vertices.back().around = static_cast<double>(i);
      }
      rings.push_back(ring);
    }
    for (std::size_t k = 0; k + 1 < rings.size(); ++k)
      joinRings(rings[k], rings[k + 1], true,
                static_cast<double>(k) < kNostrilRim ? Material::skin : Material::nostril);
    const auto& f = rings.back();
    addPolygon({f[0], f[3], f[2], f[1]}, Material::nostril);
  }

  void makeEar() {
    std::vector<int> block;  // from the middle of the front side over the top
    constexpr int kMiddle = (kEarTop + kEarBottom) / 2;
    for (int r = kMiddle; r > kEarTop; --r) block.push_back(grid(r, kEarFront));
    for (int c = kEarFront; c < kEarBehind; ++c) block.push_back(grid(kEarTop, c));
    for (int r = kEarTop; r < kEarBottom; ++r) block.push_back(grid(r, kEarBehind));
    for (int c = kEarBehind; c > kEarFront; --c) block.push_back(grid(kEarBottom, c));
    for (int r = kEarBottom; r > kMiddle; --r) block.push_back(grid(r, kEarFront));
    for (std::size_t i = 0; i < block.size(); ++i) {
      HalfVertex& v = mesh_.vertices[static_cast<std::size_t>(block[i])];
      v.strip = Strip::ear;
      v.around = static_cast<double>(i);
    }
    std::vector<std::vector<int>> rings{block};
    for (double ring = kEarRoot; ring <= kEarFloor; ring += 1)
      rings.push_back(stripRing(Strip::ear, ring, kEarAround, false));
    for (std::size_t k = 0; k + 1 < rings.size(); ++k) joinRings(rings[k], rings[k + 1], true, Material::skin);
    // Hair above and behind the ear, down to where it leaves the head.
    const std::size_t first = mesh_.polygons.size() - (rings.size() - 1) * kEarAround;
    for (std::size_t i = 2; i < 7; ++i) mesh_.polygons[first + i].material = Material::hair;
    const auto& f = rings.back();
    // Cap: a ladder from front to back.
    addPolygon({f[0], f[11], f[1]}, Material::skin);
    for (std::size_t i = 1; i < 5; ++i) addPolygon({f[i], f[12 - i], f[11 - i], f[i + 1]}, Material::skin);
    addPolygon({f[5], f[7], f[6]}, Material::skin);
  }

  HalfMesh mesh_;
  std::array<std::array<int, kColumns + 1>, kRows + 1> grid_{};
};

void place(HalfVertex& v) {
  if (v.hold == Hold::strip) v.position = stripPoint(v.strip, v.ring, v.around);
  if (v.midline) v.position.x = 0;
}

// The vertex in the middle of others of the coarser mesh.
HalfVertex between(const std::vector<HalfVertex>& vertices, const std::vector<int>& of) {
  HalfVertex out;
  const double n = static_cast<double>(of.size());
  bool strip = true, held = true, linear = false, midline = true, border = true;
  const HalfVertex& first = vertices[static_cast<std::size_t>(of[0])];
  const int period = stripPeriod(first.strip);
  double lowest = 1e9, highest = -1e9;
  for (const int i : of) {
    const HalfVertex& v = vertices[static_cast<std::size_t>(i)];
    out.position = out.position + v.position;
    strip = strip && v.strip != Strip::none && v.strip == first.strip;
    held = held && v.hold == Hold::strip;
    linear = linear || v.hold == Hold::linear;
    midline = midline && v.midline;
    border = border && v.border;
    double around = v.around;
    if (strip && period > 0) {
      if (around - first.around > period / 2.0) around -= period;
      if (around - first.around < -period / 2.0) around += period;
    }
    out.ring += v.ring;
    out.around += around;
    lowest = std::min(lowest, around);
    highest = std::max(highest, around);
  }
  out.position = out.position * (1 / n);
  out.midline = midline && of.size() == 2;
  out.border = border && of.size() == 2;
  if (strip && held && highest - lowest > 1.001) linear = true;  // across a cap, not along a ring
  if (linear) {
    out.hold = Hold::linear;
  } else if (strip) {
    out.hold = held ? Hold::strip : Hold::skin;
    out.strip = first.strip;
    out.ring /= n;
    out.around /= n;
    if (period > 0 && out.around < 0) out.around += period;
  }
  place(out);
  return out;
}

}  // namespace

HalfMesh makeCage() { return CageBuilder().build(); }

HalfMesh split(const HalfMesh& coarse) {
  HalfMesh fine;
  fine.vertices = coarse.vertices;
  std::unordered_map<std::uint64_t, int> middle;  // looked up only, never iterated
  const auto edgeMiddle = [&](int a, int b) {
    const auto key = (static_cast<std::uint64_t>(std::min(a, b)) << 32) | static_cast<std::uint64_t>(std::max(a, b));
    const auto [it, is_new] = middle.try_emplace(key, static_cast<int>(fine.vertices.size()));
    if (is_new) fine.vertices.push_back(between(coarse.vertices, {std::min(a, b), std::max(a, b)}));
    return it->second;
  };
  for (const Polygon& polygon : coarse.polygons) {
    const std::size_t n = polygon.corners.size();
    const int centre = static_cast<int>(fine.vertices.size());
    fine.vertices.push_back(between(coarse.vertices, polygon.corners));
    for (std::size_t i = 0; i < n; ++i) {
      const int before = polygon.corners[(i + n - 1) % n], here = polygon.corners[i],
                after = polygon.corners[(i + 1) % n];
      fine.polygons.push_back(
          {{here, edgeMiddle(here, after), centre, edgeMiddle(before, here)}, polygon.material, {}});
    }
  }
  return fine;
}

void raiseHair(HalfMesh& mesh, double thickness) {
  // Rings of vertices inward from the hair line.
  constexpr int kRamp = 8;
  std::vector<int> depth(mesh.vertices.size(), kRamp);
  for (const Polygon& polygon : mesh.polygons)
    if (polygon.material != Material::hair)
      for (const int c : polygon.corners) depth[static_cast<std::size_t>(c)] = 0;
  for (int level = 0; level + 1 < kRamp; ++level)
    for (const Polygon& polygon : mesh.polygons) {
      bool touches = false;
      for (const int c : polygon.corners) touches = touches || depth[static_cast<std::size_t>(c)] == level;
      if (!touches) continue;
      for (const int c : polygon.corners) {
        int& d = depth[static_cast<std::size_t>(c)];
        if (d > level + 1) d = level + 1;
      }
    }
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    if (depth[i] == 0) continue;
    HalfVertex& v = mesh.vertices[i];
    const Vec3 p = v.position;
    // A quick step at the hair line, then growing inward.
    const double t = static_cast<double>(depth[i]) / kRamp, ramp = 0.30 * std::fmin(1, 3.0 * t) + 0.70 * t * (2 - t);
    Vec3 normal = normalized(skinGradient(p));
    if (v.midline) normal.x = 0;
    // Full on top and in front, short at the sides and at the nape.
    const double top = smoothstep(3.5, 10.0, p.y), front = smoothstep(-3, 6.5, p.z);
    const double fullness = 0.22 + top * (0.95 + 0.95 * front);
    // Combed back: furrows that run from front to back, between locks of the same angle about the head's long axis.
    const double angle = std::atan2(p.x, p.y + 1.0);
    const double lock = std::cos(angle * 9.5 - 0.35 * smoothstep(-6, 6, p.z));
    const double furrow = 0.22 * (1 - std::sqrt(std::fabs(lock))) * smoothstep(0, 3, p.y);
    // Thinner where the ear stands in the way.
    const double z = (p.z + 0.1) / 2.0, y = (p.y + 1.65) / 3.2;
    const double near_ear = p.x > 4 ? 1 - smoothstep(0.95, 1.6, std::sqrt(y * y + z * z)) : 0;
    v.position = p + normal * (thickness * ramp * (1 - 0.85 * near_ear) * std::fmax(0.15, fullness - furrow));
    if (v.midline) v.position.x = 0;
  }
}

void sinkNostrils(HalfMesh& mesh) {
  for (HalfVertex& v : mesh.vertices)
    if (v.strip == Strip::nostril && v.ring > kNostrilRim)
      v.position = v.position + kNostrilInward * (0.34 * std::sqrt(v.ring - kNostrilRim));
}

void startAtBetterCorner(HalfMesh& mesh) {
  constexpr double kSliver = 0.2, kBetter = 1.5;
  for (Polygon& polygon : mesh.polygons) {
    if (polygon.corners.size() != 4) continue;
    const auto at = [&](std::size_t c) {
      return mesh.vertices[static_cast<std::size_t>(polygon.corners[c % 4])].position;
    };
    const Vec3 facing = normalized(cross(at(2) - at(0), at(3) - at(1)));
    // Of the worse of the two triangles: its area, as the quad sees it, in squares of its longest edge.
    const auto roundness = [&](std::size_t first) {
      double worst = 1;
      for (const std::size_t c : {first + 1, first + 2}) {
        const Vec3 a = at(first), b = at(c), d = at(c + 1);
        const double longest = std::fmax(length(b - a), std::fmax(length(d - b), length(a - d)));
        worst = std::fmin(worst, dot(cross(b - a, d - a), facing) / (longest * longest));
      }
      return worst;
    };
    const double now = roundness(0);
    if (now > kSliver || roundness(1) < kBetter * now) continue;
    std::rotate(polygon.corners.begin(), polygon.corners.begin() + 1, polygon.corners.end());
    if (!polygon.uv.empty()) std::rotate(polygon.uv.begin(), polygon.uv.begin() + 1, polygon.uv.end());
  }
}

void relax(HalfMesh& mesh, int rounds, double strength) {
  const std::size_t n = mesh.vertices.size();
  std::vector<std::vector<int>> neighbours(n);
  for (const Polygon& polygon : mesh.polygons)
    for (std::size_t i = 0; i < polygon.corners.size(); ++i) {
      const int a = polygon.corners[i], b = polygon.corners[(i + 1) % polygon.corners.size()];
      auto& na = neighbours[static_cast<std::size_t>(a)];
      auto& nb = neighbours[static_cast<std::size_t>(b)];
      if (std::find(na.begin(), na.end(), b) == na.end()) na.push_back(b);
      if (std::find(nb.begin(), nb.end(), a) == nb.end()) nb.push_back(a);
    }
  // The hair line is evened out along itself, which rounds the corners that it has on the coarse mesh.
  std::vector<std::vector<int>> along_hair(n);
  {
    std::unordered_map<std::uint64_t, int> sides;  // hair polygons counted up, others down
    const auto key = [](int a, int b) {
      return (static_cast<std::uint64_t>(std::min(a, b)) << 32) | static_cast<std::uint64_t>(std::max(a, b));
    };
    for (const Polygon& polygon : mesh.polygons)
      for (std::size_t i = 0; i < polygon.corners.size(); ++i)
        sides[key(polygon.corners[i], polygon.corners[(i + 1) % polygon.corners.size()])] +=
            polygon.material == Material::hair ? 1 : 3;
    for (std::size_t i = 0; i < n; ++i)
      for (const int j : neighbours[i])
        if (sides[key(static_cast<int>(i), j)] == 4) along_hair[i].push_back(j);
  }
  std::vector<Vec3> next(n);
  for (int round = 0; round <= rounds; ++round) {
    for (std::size_t i = 0; i < n; ++i) {
      HalfVertex& v = mesh.vertices[i];
      next[i] = v.position;
      if (v.hold != Hold::skin) continue;
      if (round > 0) {
        Vec3 sum;
        double weight = 0;
        for (const int j : along_hair[i].empty() ? neighbours[i] : along_hair[i]) {
          const HalfVertex& other = mesh.vertices[static_cast<std::size_t>(j)];
          if (v.border && !other.border) continue;
          // On the midline the mirrored neighbour pulls as much as the one we have.
          double w = v.midline && !other.midline ? 2 : 1;
          // Along a ring around a hole the pull is weak: a ring that shortens itself would slip into the hole.
          if ((v.strip == Strip::eye || v.strip == Strip::mouth) && v.strip == other.strip && v.ring == other.ring)
            w *= 0.15;
          if (v.strip == Strip::mouth && (other.strip != Strip::mouth || other.ring < v.ring)) w *= 1.5;
          // Around the ear's root the skin would be drawn under the ear.
          if (v.strip == Strip::ear && (other.strip != Strip::ear || other.ring < v.ring)) w *= 2.2;
          // Rings that end in nothing would draw together on a point: the outer neighbour pulls more.
          if (v.strip == Strip::nostril && (other.strip != Strip::nostril || other.ring < v.ring)) w *= 3.0;
          sum = sum + other.position * w;
          weight += w;
        }
        if (v.midline) sum.x = 0;
        // Along the skin only: without that, tips and ridges lose their vertices.
        Vec3 move = (sum * (1 / weight) - v.position) * strength;
        const Vec3 normal = normalized(skinGradient(v.position));
        move = move - normal * dot(move, normal);
        next[i] = v.position + move;
        if (v.midline) next[i].x = 0;
      }
      const double height = v.position.y;
      next[i] = projectToSkin(next[i]);
      if (v.border) next[i].y = height;
    }
    for (std::size_t i = 0; i < n; ++i) mesh.vertices[i].position = next[i];
  }
}

void polish(HalfMesh& mesh, int rounds) {
  const std::size_t n = mesh.vertices.size();
  std::vector<double> free;
  for (const HalfVertex& v : mesh.vertices) {
    double f = v.hold == Hold::skin && !v.border ? 1 : 0;
    if (v.strip == Strip::nostril) f *= clamp01(0.6 * (kNostrilRim - v.ring));
    if (v.strip == Strip::mouth && v.hold == Hold::skin) f *= clamp01(2 * (kLipBorder - 0.4 - v.ring));
    if (v.strip == Strip::eye && v.ring < kLidCrease) f = clamp01(1.6 * (kLidCrease - 0.2 - v.ring));
    free.push_back(f);
  }
  // The hair line is a drawn curve: its vertices touch both.
  std::vector<int> touches(n, 0);
  for (const Polygon& polygon : mesh.polygons)
    for (const int c : polygon.corners)
      touches[static_cast<std::size_t>(c)] |= polygon.material == Material::hair ? 1 : 2;
  for (std::size_t i = 0; i < n; ++i)
    if (touches[i] == 3) free[i] = 0;
  for (int round = 0; round < 2 * rounds; ++round) {
    const double strength = round % 2 == 0 ? 0.50 : -0.53;
    std::vector<Vec3> sum(n);
    std::vector<double> count(n, 0);
    for (const Polygon& polygon : mesh.polygons)
      for (std::size_t i = 0; i < polygon.corners.size(); ++i) {
        const auto a = static_cast<std::size_t>(polygon.corners[i]);
        const auto b = static_cast<std::size_t>(polygon.corners[(i + 1) % polygon.corners.size()]);
        sum[a] = sum[a] + mesh.vertices[b].position;
        sum[b] = sum[b] + mesh.vertices[a].position;
        count[a] += 1;
        count[b] += 1;
      }
    for (std::size_t i = 0; i < n; ++i) {
      HalfVertex& v = mesh.vertices[i];
      if (free[i] == 0) continue;
      v.position = lerp(v.position, sum[i] * (1 / count[i]), strength * free[i]);
      if (v.midline) v.position.x = 0;
    }
  }
}

}  // namespace volto::head
