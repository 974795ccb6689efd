#include "tools/cli/rig_points.h"

#include <algorithm>
#include <cstdio>
#include <numeric>
#include <optional>
#include <variant>

#include "rig/finding/find_face.h"
#include "rig/fitting/fit_points.h"

namespace volto::cli {
namespace {

// "74 points fitted to 10 given, confidence 0.78; check 2.13 (0.30) 2.14 (0.31)"
std::string summary(const rig::FittedPoints& fitted, std::size_t given, bool found) {
  double confidence = 0;
  for (const double c : fitted.confidence) confidence += c;
  confidence -= static_cast<double>(given);
  confidence /= std::max(1.0, static_cast<double>(kFeaturePointCount - given));
  std::array<char, 32> mean{};
  std::snprintf(mean.data(), mean.size(), "%.2f", confidence);
  std::string line = std::to_string(kFeaturePointCount - given) + " feature points ";
  if (found)
    line += "found on the surface";
  else
    line += "fitted to the " + std::to_string(given) + " given";
  line += ", confidence " + std::string(mean.data());
  if (fitted.to_check.empty()) return line;
  line += "; check";
  for (const std::size_t p : fitted.to_check) {
    std::array<char, 48> point{};
    std::snprintf(point.data(), point.size(), " %s (%.2f)", rig::featurePoints()[p].id.data(), fitted.confidence[p]);
    line += point.data();
  }
  return line;
}

rig::FeaturePointPositions positionsOf(const rig::Mesh& mesh, const rig::FeaturePointChoices& points) {
  rig::FeaturePointPositions out;
  for (const auto& [p, choice] : points) {
    const auto* vertex = std::get_if<std::uint32_t>(&choice);
    const auto row = static_cast<Eigen::Index>(p);
    out.row(row) = vertex != nullptr ? Eigen::RowVector3d(mesh.positions.row(*vertex))
                                     : Eigen::RowVector3d(std::get<Eigen::Vector3d>(choice).transpose());
  }
  return out;
}

// The points say which of two heads is meant; that the other one stays as it is should not come as a surprise.
void noteOtherFace(const rig::Mesh& mesh, const rig::FeaturePointPositions& points, std::vector<std::string>& notes) {
  const std::optional<double> apart = rig::findAnotherFace(mesh, points);
  if (!apart) return;
  std::array<char, 160> line{};
  std::snprintf(line.data(), line.size(),
                "there is another face, %.1f eye separations from the one that the points are on: it is not rigged and "
                "stays as it is",
                *apart);
  notes.emplace_back(line.data());
}

}  // namespace

CompletePoints completePoints(const rig::Mesh& mesh, const rig::FeaturePointChoices& given) {
  CompletePoints out;
  if (given.size() == kFeaturePointCount) {
    rig::CheckedPoints checked = rig::checkPoints(mesh, given);
    noteOtherFace(mesh, positionsOf(mesh, checked.points), checked.notes);
    return {std::move(checked.points), std::move(checked.notes)};
  }
  const bool find = given.size() < rig::kFewestPoints;
  rig::FittedPoints fitted;
  if (find) {
    const rig::FoundFace face = rig::findFace(mesh);
    out.notes = face.notes;
    std::vector<rig::RoughPoint> rough;
    for (const rig::RoughLandmark& l : face.landmarks)
      rough.push_back({l.feature_point, l.position, 0.03 + 0.15 * (1 - std::clamp(l.confidence, 0.0, 1.0))});
    if (face.reversed_polygons.empty()) {
      fitted = rig::fitPoints(mesh, given, rough);
    } else {
      rig::Mesh mended = mesh;
      rig::reversePolygons(mended, face.reversed_polygons);
      fitted = rig::fitPoints(mended, given, rough);
    }
  } else {
    fitted = rig::fitPoints(mesh, given);
    noteOtherFace(mesh, fitted.positions, out.notes);
  }
  out.points = std::move(fitted.points);
  out.notes.insert(out.notes.end(), fitted.notes.begin(), fitted.notes.end());
  out.notes.push_back(summary(fitted, given.size(), find));
  return out;
}

}  // namespace volto::cli
