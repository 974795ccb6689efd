#include "rig/finding/face_template.h"

#include <algorithm>
#include <cmath>

#include "rig/finding/surface_samples.h"
#include "rig/fitting/generic_head.h"

namespace volto::rig {
namespace {

constexpr double kNeckEnds = -2.6;  // y: necks differ too much below

// 1 inside an ellipse around eyes, nose, mouth and chin, falling to 0 softly.
Grid faceMask(const Relief& relief) {
  Grid mask(relief.depth.width, relief.depth.height);
  for (int j = 0; j < mask.height; ++j)
    for (int i = 0; i < mask.width; ++i) {
      const Eigen::Vector2d p = Relief::positionOf(i, j, relief.pixel);
      const double r = std::hypot(p.x() / 0.8, (p.y() + 0.55) / 1.2);
      mask.at(i, j) = static_cast<float>(r < 1 ? 1 : std::exp(-std::pow((r - 1) / 0.15, 2)));
      if (mask.at(i, j) < 0.01F) mask.at(i, j) = 0;
    }
  return mask;
}

FaceTemplate makeTemplate() {
  const GenericHead& head = genericHead();
  FaceTemplate result;
  for (std::size_t i = 0; i < kFeaturePointCount; ++i) {
    Eigen::Vector3d p = Eigen::Vector3d::Zero();
    for (std::size_t c = 0; c < 3; ++c)
      p += head.points[i].weights[c] * head.face.positions.row(head.points[i].vertices[c]).transpose();
    result.landmarks.row(static_cast<Eigen::Index>(i)) = p;
  }
  const NormalisedSurface surface = normaliseSurface(head.mesh);
  const FaceFrame frame{Eigen::Matrix3d::Identity(), -surface.centre / surface.size, 1 / surface.size};
  const double pixels[2] = {kCoarsePixel, kFinePixel};
  for (std::size_t k = 0; k < 2; ++k) {
    result.relief[k] = renderRelief(surface, frame, pixels[k]);
    result.mask[k] = faceMask(result.relief[k]);
    constexpr double kParts[4][2] = {{0.5, 0}, {-0.5, 0}, {0, -0.6}, {0, -1.05}};
    for (std::size_t part = 0; part < 4; ++part)
      result.parts[k][part] = softWindow(result.relief[k], {kParts[part][0], kParts[part][1]}, 0.3);
  }
  // Farthest points first: any first part is spread over the whole, at twice the density on the face.
  std::vector<Eigen::Vector3d> points, normals;
  for (const SurfaceSample& s : sampleVisibleSurface(surface, 16000)) {
    Eigen::Vector3d p = frame.toHead(s.position);
    if (p.y() < kNeckEnds) continue;
    Eigen::Vector3d n = s.normal;
    if (p.x() < 0) p.x() = -p.x(), n.x() = -n.x();
    points.push_back(p);
    normals.push_back(n);
  }
  constexpr std::size_t kCount = 500;
  std::vector<double> distance(points.size(), 1e9);
  std::size_t next = 0;
  auto onFace = [](const Eigen::Vector3d& p) { return p.z() > -0.6 && p.y() > -1.9 && p.y() < 0.7; };
  for (std::size_t k = 0; k < std::min(kCount, points.size()); ++k) {
    result.points.push_back(points[next]);
    result.normals.push_back(normals[next]);
    result.on_face.push_back(onFace(points[next]));
    const Eigen::Vector3d last = points[next];
    double best = -1;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const double d = (points[i] - last).squaredNorm() * (onFace(points[i]) ? 6 : 1);
      distance[i] = std::min(distance[i], d);
      if (distance[i] > best) best = distance[i], next = i;
    }
  }
  return result;
}

}  // namespace

Grid softWindow(const Relief& relief, const Eigen::Vector2d& centre, double radius) {
  Grid window(relief.depth.width, relief.depth.height);
  for (int j = 0; j < window.height; ++j)
    for (int i = 0; i < window.width; ++i) {
      const double r = (Relief::positionOf(i, j, relief.pixel) - centre).norm() / radius;
      if (r < 2.5) window.at(i, j) = static_cast<float>(std::exp(-r * r));
    }
  return window;
}

const FaceTemplate& faceTemplate() {
  static const FaceTemplate made = makeTemplate();
  return made;
}

}  // namespace volto::rig
