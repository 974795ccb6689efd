#include "rig/assets/head/parts.h"

#include <array>
#include <cstddef>

#include "rig/assets/head/skin_field.h"

namespace volto::head {
namespace {

constexpr double kPi = 3.14159265358979323846;

// Local texture coordinates of a polygon: upper left corner first, counter-clockwise.
std::vector<std::array<double, 2>> rectangle(double left, double top, double right, double bottom) {
  return {{left, top}, {left, bottom}, {right, bottom}, {right, top}};
}

// A sheet of rows x columns quads; rows or columns may close on themselves. `at(r, c)` gives the vertex; seen from
// outside, rows run down and columns to the right.
template <typename At, typename MaterialOf>
void addSheet(HalfMesh& mesh, int rows, int columns, bool rows_closed, bool columns_closed, At at,
              MaterialOf material) {
  const int row_count = rows_closed ? rows : rows + 1, column_count = columns_closed ? columns : columns + 1;
  const int first = static_cast<int>(mesh.vertices.size());
  for (int r = 0; r < row_count; ++r)
    for (int c = 0; c < column_count; ++c) mesh.vertices.push_back(at(r, c));
  const auto index = [&](int r, int c) { return first + (r % row_count) * column_count + c % column_count; };
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < columns; ++c)
      mesh.polygons.push_back({{index(r, c), index(r + 1, c), index(r + 1, c + 1), index(r, c + 1)},
                               material(r, c),
                               rectangle(c, -r, c + 1, -r - 1)});
}

HalfVertex vertex(const Vec3& p, bool midline = false) {
  HalfVertex v;
  v.position = p;
  v.midline = midline;
  v.hold = Hold::linear;
  if (midline) v.position.x = 0;
  return v;
}

// Closes the first or last row of a sheet with one polygon fan around a pole.
void addFan(HalfMesh& mesh, const std::vector<int>& ring, const Vec3& pole, bool facing_ring_order, Material material,
            bool midline = false) {
  const int centre = static_cast<int>(mesh.vertices.size());
  mesh.vertices.push_back(vertex(pole, midline));
  const std::size_t n = ring.size();
  for (std::size_t i = 0; i < n; ++i) {
    const int a = ring[i], b = ring[(i + 1) % n];
    if (facing_ring_order)
      mesh.polygons.push_back({{centre, a, b}, material, {}});
    else
      mesh.polygons.push_back({{centre, b, a}, material, {}});
  }
}

// --- teeth
// -----------------------------------------------------------------------------------------------------------------------

struct Arch {
  double half_width, front_z, back_z;  // of the outer surface
  double gum_y, edge_y;                // where gum and biting edge are
};

// One tooth after another from the middle: widths of incisors, canine, premolars and molars, outer end of each along
// the arch (cm).
constexpr std::array<double, 8> kToothEnds{0.0, 0.86, 1.54, 2.28, 2.96, 3.64, 4.6, 5.5};

HalfMesh makeTeeth(const Arch& arch, double width_scale) {
  constexpr int kPerTooth = 3, kTeeth = 7, kProfile = 9;
  HalfMesh mesh;
  // Arc length along a half ellipse, tabulated.
  constexpr int kSamples = 400;
  std::array<double, kSamples + 1> arc{};
  const double depth = arch.front_z - arch.back_z;
  const auto ellipse = [&](double a, double inward) {
    // Flatter in front than an ellipse, as a row of incisors is.
    const double s = std::sin(a), c = std::cos(a);
    const double across = s > 0 ? std::pow(s, 0.80) : 0, along = c > 1e-9 ? std::pow(c, 0.80) : 0;
    return Vec3{(arch.half_width - inward) * across, 0, arch.back_z + (depth - inward) * along};
  };
  for (std::size_t i = 1; i <= kSamples; ++i)
    arc[i] = arc[i - 1] + length(ellipse(kPi / 2 * static_cast<double>(i) / kSamples, 0) -
                                 ellipse(kPi / 2 * static_cast<double>(i - 1) / kSamples, 0));
  const auto angleAt = [&](double s) {
    std::size_t i = 1;
    while (i < kSamples && arc[i] < s) ++i;
    return kPi / 2 * (static_cast<double>(i) - 1 + (s - arc[i - 1]) / (arc[i] - arc[i - 1])) / kSamples;
  };
  const double towards_edge = arch.edge_y < arch.gum_y ? -1 : 1;
  const double tall = std::fabs(arch.edge_y - arch.gum_y);
  constexpr int kColumns = kPerTooth * kTeeth;
  const auto at = [&](int row, int column) {
    const auto tooth = static_cast<std::size_t>(column == kColumns ? kTeeth - 1 : column / kPerTooth);
    const double f = static_cast<double>(column - static_cast<int>(tooth) * kPerTooth) / kPerTooth;
    const double s = width_scale * lerp(kToothEnds[tooth], kToothEnds[tooth + 1], f);
    const double round = 4 * f * (1 - f);  // 0 between two teeth, 1 in the middle of one
    const double molar = smoothstep(2.5, 4.0, static_cast<double>(tooth));
    // Profile: gum in front, over the tooth to the biting edge, back up behind.
    constexpr std::array<double, kProfile + 1> kDown{-0.30, 0.0, 0.06, 0.5, 0.88, 1.0, 0.96, 0.6, 0.0, -0.30};
    constexpr std::array<double, kProfile + 1> kIn{0.06, 0.02, 0.0, -0.04, 0.0, 0.10, 0.20, 0.32, 0.45, 0.5};
    const auto k = static_cast<std::size_t>(row);
    double down = kDown[k], in = kIn[k];
    if (k >= 5 && k <= 8) in += 0.45 * molar;
    if (k >= 2 && k <= 7) in += 0.07 * (1 - round);
    if (k >= 4 && k <= 6) down -= 0.07 * (1 - round) * (1 - round) + 0.12 * molar;
    if (k == 1 || k == 2) down += 0.12 * (round - 0.5);  // scalloped gum line
    Vec3 p = ellipse(angleAt(s), in);
    p.y = arch.gum_y + towards_edge * tall * down;
    return vertex(p, column == 0);
  };
  const auto material = [&](int row, int) { return row < 1 || row >= 8 ? Material::gums : Material::teeth; };
  addSheet(mesh, kProfile, kColumns, false, false, at, material);
  // Back of the gum, and the far end.
  const auto index = [&](int row, int column) { return row * (kColumns + 1) + column; };
  for (int c = 0; c < kColumns; ++c)
    mesh.polygons.push_back({{index(kProfile, c), index(0, c), index(0, c + 1), index(kProfile, c + 1)},
                             Material::gums,
                             rectangle(c, -kProfile, c + 1, -kProfile - 1)});
  std::vector<int> end;
  for (int r = 0; r <= kProfile; ++r) end.push_back(index(r, kColumns));
  for (std::size_t i = 0; i + 1 < 5; ++i)
    mesh.polygons.push_back(
        {{end[i], end[i + 1], end[9 - (i + 1)], end[9 - i]},
         i == 0 ? Material::gums : Material::teeth,
         rectangle(kColumns + 1, -static_cast<double>(i), kColumns + 3, -static_cast<double>(i) - 1)});
  if (towards_edge > 0)  // profile runs the other way round: turn the polygons
    for (Polygon& polygon : mesh.polygons) {
      std::swap(polygon.corners[1], polygon.corners[3]);
      std::swap(polygon.uv[1], polygon.uv[3]);
    }
  return mesh;
}

}  // namespace

HalfMesh makeEyeball(double iris_size, double pupil_size) {
  HalfMesh mesh;
  constexpr int kAround = 28;
  // Distance from the axis of each ring's edge (iris), then angle for the white.
  const double pupil = 0.23 * pupil_size, iris = 0.60 * iris_size, iris_rim = 0.665 * iris_size;
  std::vector<double> angles;
  std::vector<Material> materials;  // of the band that ends at the angle of the same place
  const auto ringAt = [&](double radius, Material m) {
    angles.push_back(std::asin(radius / kEyeRadius));
    materials.push_back(m);
  };
  ringAt(pupil * 0.5, Material::pupil);
  ringAt(pupil, Material::pupil);
  ringAt(lerp(pupil, iris, 0.33), Material::iris);
  ringAt(lerp(pupil, iris, 0.67), Material::iris);
  ringAt(iris, Material::iris);
  ringAt(iris_rim, Material::iris_rim);
  const double start = angles.back();
  for (int i = 1; i <= 6; ++i) {
    angles.push_back(lerp(start, kPi * 0.96, i / 6.0));
    materials.push_back(Material::eye_white);
  }
  const auto at = [&](int row, int column) {
    // Columns run clockwise seen from in front, so that rows (outward) and columns face out.
    const double a = 2 * kPi * column / kAround, r = angles[static_cast<std::size_t>(row)];
    return vertex(kEyeCentre + Vec3{std::sin(r) * std::cos(a), std::sin(r) * std::sin(a), std::cos(r)} * kEyeRadius);
  };
  const auto material = [&](int row, int) { return materials[static_cast<std::size_t>(row) + 1]; };
  addSheet(mesh, static_cast<int>(angles.size()) - 1, kAround, false, true, at, material);
  std::vector<int> front, back;
  for (int c = 0; c < kAround; ++c) {
    front.push_back(c);
    back.push_back((static_cast<int>(angles.size()) - 1) * kAround + c);
  }
  addFan(mesh, front, kEyeCentre + Vec3{0, 0, kEyeRadius}, true, Material::pupil);
  addFan(mesh, back, kEyeCentre - Vec3{0, 0, kEyeRadius}, false, Material::eye_white);
  // Seen from in front, the distance from the middle growing with the angle as far as the pole behind.
  for (Polygon& polygon : mesh.polygons) {
    const auto outward = [&](int v) { return mesh.vertices[static_cast<std::size_t>(v)].position - kEyeCentre; };
    Vec3 middle;
    for (const int c : polygon.corners) middle = middle + outward(c);
    polygon.uv.clear();
    for (const int c : polygon.corners) {
      const Vec3 d = outward(c);
      const double flat = std::sqrt(d.x * d.x + d.y * d.y), angle = std::atan2(flat, d.z);
      const bool behind = angle > kPi - 1e-6;
      const Vec3 way = normalized(behind ? Vec3{middle.x, middle.y, 0} : Vec3{d.x, d.y, 0});
      polygon.uv.push_back({way.x * angle, way.y * angle});
    }
  }
  return mesh;
}

HalfMesh makeUpperTeeth() { return makeTeeth({2.45, 8.80, 5.6, -6.05, -6.98}, 0.88); }
HalfMesh makeLowerTeeth() { return makeTeeth({2.25, 8.52, 5.5, -7.66, -6.99}, 0.80); }

HalfMesh makeTongue() {
  HalfMesh mesh;
  constexpr int kAround = 10, kAlong = 12;  // half a cross section from top to bottom; from tip to root
  const auto at = [&](int row, int column) {
    const double t = (row + 0.35) / (kAlong + 0.35);
    const double a = kPi * column / kAround;
    const double width = 1.15 * std::sqrt(1 - (1 - t) * (1 - t) * (1 - t) * (1 - t)),
                 thick = 0.18 + 0.34 * std::sqrt(t);
    const double groove =
        0.10 * smoothstep(0.05, 0.4, t) * (1 - smoothstep(0.0, 0.35, std::sin(a))) * (column < kAround / 2 ? 1 : 0);
    const Vec3 p{width * std::sin(a), -7.47 + 0.16 * t + thick * std::cos(a) - groove, 8.0 - 3.0 * t};
    return vertex(p, column == 0 || column == kAround);
  };
  addSheet(
      mesh, kAlong, kAround, false, false, [&](int r, int c) { return at(kAlong - r, c); },
      [](int, int) { return Material::tongue; });
  // Tip: a fan from the middle.
  const int centre = static_cast<int>(mesh.vertices.size());
  mesh.vertices.push_back(vertex({0, -7.47, 8.05}, true));
  for (int c = 0; c < kAround; ++c) {
    const int row = kAlong * (kAround + 1);
    mesh.polygons.push_back({{row + c, centre, row + c + 1},
                             Material::tongue,
                             {{c + 0.0, -kAlong}, {c + 0.5, -kAlong - 1}, {c + 1.0, -kAlong}}});
  }
  const int root = static_cast<int>(mesh.vertices.size());
  mesh.vertices.push_back(vertex({0, -7.31, 4.9}, true));
  for (int c = 0; c < kAround; ++c)
    mesh.polygons.push_back({{root, c, c + 1}, Material::tongue, {{c + 0.5, 1}, {c + 0.0, 0}, {c + 1.0, 0}}});
  return mesh;
}

HalfMesh makeUpperLashes() {
  HalfMesh mesh;
  constexpr int kSteps = 24;
  const auto at = [&](int row, int column) {
    const double t = static_cast<double>(column) / kSteps;
    const double around = lerp(1.2, 7.6, t);
    const Vec3 margin = lidMargin(around);
    const Vec3 out = normalized(margin - kEyeCentre);
    const Vec3 root = margin + normalized(out + Vec3{0, -0.6, 0.6}) * 0.035;  // before the lid, not in it
    const double reach = 0.05 + 0.25 * smoothstep(0.0, 0.75, t) * (1 - 0.8 * smoothstep(0.86, 1.0, t));
    const Vec3 forward = normalized(out + Vec3{0.4 * (t - 0.3), 0.10, 0.25});
    Vec3 p = root;
    if (row == 1) p = p + Vec3{0, -0.035, 0} + forward * (reach * 0.45);
    if (row == 2) p = p + forward * reach + Vec3{0, 0.35 * reach, 0};
    if (row == 3) p = p + Vec3{0, 0.020, 0.004} + forward * (reach * 0.45);
    return vertex(p);
  };
  // A thin wedge: underside from the margin to the tip, and back over the top.
  addSheet(
      mesh, 4, kSteps, true, false, [&](int r, int c) { return at((4 - r) % 4, c); },
      [](int, int) { return Material::lashes; });
  mesh.polygons.push_back(
      {{3 * (kSteps + 1), 2 * (kSteps + 1), kSteps + 1, 0}, Material::lashes, rectangle(-2, -1, -1, -3)});
  const int e = kSteps;
  mesh.polygons.push_back({{e, e + kSteps + 1, e + 2 * (kSteps + 1), e + 3 * (kSteps + 1)},
                           Material::lashes,
                           rectangle(kSteps + 1, -1, kSteps + 2, -3)});
  return mesh;
}

Vec3 browLine(double t) {
  // Quadratic through the inner end, the peak and the outer end.
  const double x = lerp(1.05, 5.15, t);
  const double past = (t - 0.64) / 0.36;
  const double y = t < 0.64 ? lerp(2.26, 2.54, std::sin(t / 0.64 * kPi / 2)) : 2.54 - 0.55 * past * past;
  return castToSkin({x, y, 16}, {0, 0, -1});
}

HalfMesh makeBrow() {
  HalfMesh mesh;
  // A flat lens over the skin: from the upper edge over the front to the lower edge, and back up close to the skin.
  constexpr int kSteps = 20, kAcross = 5;
  const auto at = [&](int row, int column) {
    const double t = static_cast<double>(column) / kSteps;
    const Vec3 middle = browLine(t);
    const double half = 0.25 * (1 - 0.86 * smoothstep(0.25, 1.0, t)) * (0.50 + 0.50 * smoothstep(0.0, 0.15, t));
    const bool front = row <= kAcross;
    const double s =
        front ? 1 - 2.0 * row / kAcross : -1 + 2.0 * (row - kAcross) / kAcross;  // 1 upper edge, -1 lower edge
    const Vec3 on_skin = castToSkin({middle.x, middle.y + half * s, 16}, {0, 0, -1});
    const Vec3 n = normalized(skinGradient(on_skin));
    return vertex(on_skin + n * (0.035 + (front ? 0.05 * (1 - s * s) * (0.3 + 0.7 * half / 0.25) : 0.0)));
  };
  addSheet(mesh, 2 * kAcross, kSteps, true, false, at, [](int, int) { return Material::brows; });
  const auto index = [&](int r, int c) { return (r % (2 * kAcross)) * (kSteps + 1) + c; };
  for (int r = 0; r < kAcross; ++r) {  // the ends: front row r lies over back row 2 * kAcross - r
    const int back = 2 * kAcross - r;
    std::vector<int> inner{index(r, 0), index(back, 0), index(back - 1, 0), index(r + 1, 0)};
    std::vector<int> outer{index(r + 1, kSteps), index(back - 1, kSteps), index(back, kSteps), index(r, kSteps)};
    // (counter-clockwise: towards the back, down, forward)
    std::vector<std::array<double, 2>> inner_uv{{-1, 0.0 - r}, {-2, 0.0 - r}, {-2, -1.0 - r}, {-1, -1.0 - r}};
    constexpr double kRight = kSteps + 1;
    std::vector<std::array<double, 2>> outer_uv{
        {kRight, -1.0 - r}, {kRight + 1, -1.0 - r}, {kRight + 1, 0.0 - r}, {kRight, 0.0 - r}};
    const auto leaveOut = [&](std::ptrdiff_t of_inner, std::ptrdiff_t of_outer) {
      inner.erase(inner.begin() + of_inner);
      inner_uv.erase(inner_uv.begin() + of_inner);
      outer.erase(outer.begin() + of_outer);
      outer_uv.erase(outer_uv.begin() + of_outer);
    };
    if (r == 0) leaveOut(1, 2);
    if (r + 1 == kAcross) leaveOut(2, 1);
    mesh.polygons.push_back({inner, Material::brows, inner_uv});
    mesh.polygons.push_back({outer, Material::brows, outer_uv});
  }
  return mesh;
}

}  // namespace volto::head
