#include "rig/fitting/landmark_checks.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "rig/errors.h"
#include "rig/fitting/fit_points.h"

namespace volto::rig {
namespace {

constexpr double kFarOffSurface_es = 0.25;

std::string nameOf(std::size_t p) {
  const FeaturePoint& point = featurePoints()[p];
  return std::string(point.id) + " (" + std::string(point.name) + ")";
}

std::string number(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.2g", value);
  return text.data();
}

std::vector<WarpLandmark> pairsOf(const std::vector<PlacedLandmark>& landmarks, const FeaturePointPositions& generic) {
  std::vector<WarpLandmark> pairs;
  for (const PlacedLandmark& l : landmarks)
    pairs.push_back({generic.row(static_cast<Eigen::Index>(l.feature_point)), l.position, l.sigma_es});
  return pairs;
}

void exchangeSides(std::vector<PlacedLandmark>& landmarks) {
  for (PlacedLandmark& l : landmarks) l.feature_point = featurePoints()[l.feature_point].mirror;
}

// Mean of cosines between the surface's normals and the generic face's.
double agreement(const std::vector<PlacedLandmark>& landmarks, const FeaturePointPositions& normals,
                 const Similarity& s) {
  double sum = 0;
  for (const PlacedLandmark& l : landmarks)
    sum += l.normal.dot(s.rotation * normals.row(static_cast<Eigen::Index>(l.feature_point)).transpose());
  return sum / static_cast<double>(landmarks.size());
}

// A left point whose partner is given too and that fit better the other way round: all landmarks together where they are
// few, the two by themselves where one pair among many hardly shows.
void requirePairsRightWayRound(std::vector<PlacedLandmark> landmarks, const FeaturePointPositions& generic,
                               const SimilarityFit& fit) {
  const auto off2 = [&](std::size_t i, std::size_t as) {
    const Eigen::Vector3d wanted = generic.row(static_cast<Eigen::Index>(landmarks[as].feature_point));
    return (fit.similarity.inverse(landmarks[i].position) - wanted).squaredNorm();
  };
  std::string exchanged;
  for (std::size_t i = 0; i < landmarks.size(); ++i)
    for (std::size_t j = i + 1; j < landmarks.size(); ++j) {
      if (featurePoints()[landmarks[i].feature_point].mirror != landmarks[j].feature_point) continue;
      const double as_named = off2(i, i) + off2(j, j);
      const bool surely = as_named > 0.2 && off2(i, j) + off2(j, i) < 0.15 * as_named;
      std::swap(landmarks[i].feature_point, landmarks[j].feature_point);
      const double other_way = fitSimilarity(pairsOf(landmarks, generic)).rms;
      if ((surely || (fit.rms > 0.15 && other_way < 0.6 * fit.rms)) && exchanged.empty())
        exchanged = nameOf(landmarks[j].feature_point) + " and " + nameOf(landmarks[i].feature_point);
      std::swap(landmarks[i].feature_point, landmarks[j].feature_point);
    }
  if (!exchanged.empty())
    throw InputError("feature points " + exchanged +
                     " fit this head only when exchanged; left and right are the subject's own");
}

}  // namespace

FacePlacement placeFace(std::vector<PlacedLandmark>& landmarks, const FeaturePointPositions& generic,
                        const FeaturePointPositions& generic_normals, bool inside_out) {
  if (landmarks.size() < kFewestPoints) {
    std::string ten;
    for (const std::string_view id : kTenPoints) ten.append(1, ' ').append(id);
    throw InputError("only " + std::to_string(landmarks.size()) + " feature points are given; at least " +
                     std::to_string(kFewestPoints) + " are needed to fit a face, ten are good:" + ten);
  }
  FacePlacement out;
  SimilarityFit fit = fitSimilarity(pairsOf(landmarks, generic));
  if (!(fit.extent[0] > 0)) throw InputError("all feature points given are in one place");
  if (!(fit.extent[1] > 0.02 * fit.extent[0]))
    throw InputError(
        "the feature points given lie on one line; a face cannot be placed by them; add one off that line");
  for (const PlacedLandmark& l : landmarks)
    if (l.sigma_es <= 0 && l.off_surface > kFarOffSurface_es * std::abs(fit.similarity.scale))
      throw InputError("feature point " + nameOf(l.feature_point) + " lies " + number(l.off_surface) +
                       " off the surface, " + number(l.off_surface / std::abs(fit.similarity.scale)) +
                       " eye separations; move it onto the skin");

  const SimilarityFit mirrored = fitSimilarity(pairsOf(landmarks, generic), true);
  const bool looks_mirrored = mirrored.rms < 0.7 * fit.rms && fit.rms > 0.08;
  const bool looks_inward = agreement(landmarks, generic_normals, fit.similarity) < -0.2;
  if (looks_mirrored || looks_inward) {
    std::vector<PlacedLandmark> renamed = landmarks;
    exchangeSides(renamed);
    const SimilarityFit again = fitSimilarity(pairsOf(renamed, generic));
    if (again.rms < 1.2 * fit.rms && agreement(renamed, generic_normals, again.similarity) > 0) {
      if (!inside_out) {
        std::string example;
        for (const PlacedLandmark& l : landmarks)
          if (featurePoints()[l.feature_point].mirror != l.feature_point && example.empty())
            example = nameOf(l.feature_point);
        throw InputError("left and right are exchanged: " + example +
                         " is on the other side of the face; left and right are the subject's own");
      }
      landmarks = std::move(renamed);
      fit = again;
      out.sides_exchanged = true;
      out.notes.emplace_back(
          "the mesh is a mirror image (left-handed): points of the left and the right are exchanged");
    }
  }
  requirePairsRightWayRound(landmarks, generic, fit);
  if (inside_out && !out.sides_exchanged) out.notes.emplace_back("the mesh is inside out: its normals were turned");
  out.mesh_from_generic = fit.similarity;
  return out;
}

}  // namespace volto::rig
