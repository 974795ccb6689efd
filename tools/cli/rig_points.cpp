#include "tools/cli/rig_points.h"

#include <algorithm>
#include <cstdio>
#include <numeric>

#include "rig/finding/find_face.h"
#include "rig/fitting/fit_points.h"

namespace volto::cli {
namespace {

// "74 points fitted to 10 given, confidence 0.78; check 2.13 2.14"
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
  constexpr std::size_t kShown = 12;
  for (std::size_t i = 0; i < std::min(kShown, fitted.to_check.size()); ++i)
    line += " " + std::string(rig::featurePoints()[fitted.to_check[i]].id);
  if (fitted.to_check.size() > kShown) line += " and " + std::to_string(fitted.to_check.size() - kShown) + " more";
  return line;
}

}  // namespace

CompletePoints completePoints(const rig::Mesh& mesh, const rig::FeaturePointChoices& given) {
  CompletePoints out;
  if (given.size() == kFeaturePointCount) {
    rig::CheckedPoints checked = rig::checkPoints(mesh, given);
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
  }
  out.points = std::move(fitted.points);
  out.notes.insert(out.notes.end(), fitted.notes.begin(), fitted.notes.end());
  out.notes.push_back(summary(fitted, given.size(), find));
  return out;
}

}  // namespace volto::cli
