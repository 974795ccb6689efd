#include "tests/transfer/sheet.h"

#include <cmath>

namespace volto::transfer {
namespace {

// Height of the margin above the middle line, at column i.
double opening(int columns, int i, double gap) {
  const double a = columns / 3.0, b = 2 * columns / 3.0;
  if (i <= a || i >= b) return 0;
  return 0.5 * gap * std::sin(3.141592653589793 * (i - a) / (b - a));
}

}  // namespace

Sheet makeSheet(int columns, int rows, double gap) {
  Sheet sheet;
  const int middle = rows / 2;
  const auto inSlit = [&](int i) { return 3 * i > columns && 3 * i < 2 * columns; };
  std::vector<std::vector<std::uint32_t>> above,
      below;  // vertex at (row, column) as seen from the squares above and below
  std::vector<Eigen::Vector3d> points;
  const auto add = [&](int i, double y) {
    points.emplace_back(i, y, 0.02 * (i - columns / 2.0) * (i - columns / 2.0));
    return static_cast<std::uint32_t>(points.size() - 1);
  };
  for (int row = 0; row <= rows; ++row) {
    above.emplace_back();
    below.emplace_back();
    for (int i = 0; i <= columns; ++i) {
      if (row == middle && inSlit(i)) {
        const double half = opening(columns, i, gap);
        below.back().push_back(add(i, row - half));
        above.back().push_back(add(i, row + half));
        sheet.lower.push_back(below.back().back());
        sheet.upper.push_back(above.back().back());
      } else {
        below.back().push_back(add(i, row));
        above.back().push_back(below.back().back());
      }
    }
  }
  sheet.mesh.positions.resize(static_cast<Eigen::Index>(points.size()), 3);
  for (std::size_t v = 0; v < points.size(); ++v) sheet.mesh.positions.row(static_cast<Eigen::Index>(v)) = points[v];
  sheet.mesh.polygon_start.push_back(0);
  for (int row = 0; row < rows; ++row) {
    for (int i = 0; i < columns; ++i) {
      const auto r = static_cast<std::size_t>(row), c = static_cast<std::size_t>(i);
      for (const std::uint32_t v : {above[r][c], above[r][c + 1], below[r + 1][c + 1], below[r + 1][c]})
        sheet.mesh.corner_vertices.push_back(v);
      sheet.mesh.polygon_start.push_back(static_cast<std::uint32_t>(sheet.mesh.corner_vertices.size()));
    }
  }
  return sheet;
}

rig::VertexPositions closed(const Sheet& sheet, double amount) {
  rig::VertexPositions out = sheet.mesh.positions;
  for (std::size_t k = 0; k < sheet.upper.size(); ++k) {
    const Eigen::RowVector3d down = sheet.mesh.positions.row(sheet.lower[k]) - sheet.mesh.positions.row(sheet.upper[k]);
    const double x = sheet.mesh.positions(sheet.upper[k], 0), y = sheet.mesh.positions(sheet.upper[k], 1);
    for (Eigen::Index v = 0; v < out.rows(); ++v) {
      const double above = sheet.mesh.positions(v, 1) - y;
      if (sheet.mesh.positions(v, 0) == x && above >= 0) out.row(v) += amount * std::exp(-0.5 * above) * down;
    }
  }
  return out;
}

rig::VertexPositions curled(const Sheet& sheet, double angle_rad) {
  rig::VertexPositions out = sheet.mesh.positions;
  const double width = out.col(0).maxCoeff();
  for (Eigen::Index v = 0; v < out.rows(); ++v) {
    const double angle = angle_rad * out(v, 0) / width, radius = width / angle_rad + out(v, 2);
    out(v, 0) = radius * std::sin(angle);
    out(v, 2) = radius * std::cos(angle) - width / angle_rad;
  }
  return out;
}

std::vector<SlitPair> pairsOf(const Sheet& source, const Sheet& target) {
  std::vector<SlitPair> pairs;
  const auto at = [](std::uint32_t v) { return SurfacePoint{{v, v, v}, {1, 0, 0}}; };
  const auto gap = [](const Sheet& s, std::size_t k) {
    return (s.mesh.positions.row(s.upper[k]) - s.mesh.positions.row(s.lower[k])).norm();
  };
  for (std::size_t k = 0; k < source.upper.size(); ++k)
    pairs.push_back({at(target.upper[k]), at(target.lower[k]), at(source.upper[k]), at(source.lower[k]),
                     gap(target, k) / gap(source, k)});
  return pairs;
}

}  // namespace volto::transfer
