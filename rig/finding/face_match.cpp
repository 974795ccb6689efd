#include "rig/finding/face_match.h"

#include <algorithm>
#include <cmath>

namespace volto::rig {
namespace {

constexpr FlowLevel kCoarseLevels[] = {{0.2, 0.45, 6}, {0.12, 0.35, 6}};
constexpr FlowLevel kFineLevels[] = {{0.08, 0.25, 8}, {0.05, 0.2, 8}};
constexpr double kComparedAt = 0.08;
constexpr double kMouthAtLeast = 0.8;  // as likely as eyes and nose, whatever it looks like

// Where the template's pixels are on the other relief gives turn, size and place anew.
FaceFrame bettered(const FaceFrame& frame, const FaceMatch& match, const Relief& relief, const Grid& mask) {
  struct Pair {
    Eigen::Vector3d p, q;
    double weight;
  };
  const Relief& face = faceTemplate().relief[0];
  const ReliefForm form = reliefForm(face, 0.1);
  std::vector<Pair> pairs;
  Eigen::Vector2d mean_p = Eigen::Vector2d::Zero();
  Eigen::Vector2d mean_q = Eigen::Vector2d::Zero();
  double weights = 0;
  for (int j = 0; j < face.depth.height; j += 2)
    for (int i = 0; i < face.depth.width; i += 2) {
      const double slant = std::hypot(form[0].at(i, j), form[1].at(i, j));
      const double weight = mask.at(i, j) * (1 - slant);
      if (weight < 0.05) continue;
      const Eigen::Vector2d p = Relief::positionOf(i, j, face.pixel);
      const Eigen::Vector2d q = match.flow.carry(p);
      const Eigen::Vector2d at = Relief::pixelsOf(q.x(), q.y(), relief.pixel);
      const float x = static_cast<float>(at.x());
      const float y = static_cast<float>(at.y());
      if (relief.seen.sample(x, y) < 0.9F) continue;
      const Eigen::Vector3d from(p.x(), p.y(), face.depth.at(i, j));
      const Eigen::Vector3d to(q.x(), q.y(), relief.depth.sample(x, y));
      pairs.push_back({from, to, weight});
      mean_p += weight * from.tail<2>();
      mean_q += weight * to.tail<2>();
      weights += weight;
    }
  if (pairs.size() < 50) return frame;
  mean_p /= weights;
  mean_q /= weights;
  double along = 0, across = 0, x = 0, square = 0;
  for (const Pair& pair : pairs) {
    const Eigen::Vector2d p = pair.p.tail<2>() - mean_p;
    const Eigen::Vector2d q = pair.q.tail<2>() - mean_q;
    along += pair.weight * p.dot(q);
    across += pair.weight * (p.x() * q.y() - p.y() * q.x());
    x += pair.weight * pair.p.x() * pair.q.x();
    square += pair.weight * (p.squaredNorm() + pair.p.x() * pair.p.x());
  }
  const double length = std::hypot(along, across);
  const double cosine = along / length;
  const double sine = across / length;
  const double size = std::clamp((length + x) / square, 0.8, 1.25);
  Eigen::Matrix3d turn;
  turn << 1, 0, 0, 0, cosine, -sine, 0, sine, cosine;
  const Eigen::Vector2d place = mean_q - size * turn.bottomRightCorner<2, 2>() * mean_p;
  FaceFrame next;
  next.origin = frame.toMesh({0, place.x(), place.y()});
  next.mesh_from_head = frame.mesh_from_head * turn;
  next.size = frame.size * size;
  return next;
}

void judge(FaceMatch& match, std::size_t level) {
  const FaceTemplate& face = faceTemplate();
  const std::vector<ReliefLikeness> parts =
      compareReliefs(face.relief[level], match.relief, face.parts[level], match.flow, kComparedAt);
  for (std::size_t i = 0; i < 4; ++i) match.parts[i] = parts[i].mean();
  // Hair may hang over one eye.
  const double eyes = 0.75 * std::max(match.parts[0], match.parts[1]) + 0.25 * std::min(match.parts[0], match.parts[1]);
  // A mouth may be open: where eyes and nose are a face's beyond doubt, it need not look like the template's.
  const double nose = match.parts[2], mouth = match.parts[3], others = std::min(eyes, nose);
  match.likeness = (eyes + nose + mouth) / 6 + std::min(others, std::max(mouth, kMouthAtLeast * others)) / 2;
}

}  // namespace

FaceMatch glanceAtFace(const NormalisedSurface& surface, const FaceFrame& frame) {
  const FaceTemplate& face = faceTemplate();
  FaceMatch match;
  match.frame = frame;
  match.relief = renderRelief(surface, frame, kCoarsePixel);
  match.flow = registerReliefs(face.relief[0], match.relief, face.mask[0], kCoarseLevels);
  judge(match, 0);
  return match;
}

FaceMatch studyFace(const NormalisedSurface& surface, const FaceFrame& frame) {
  const FaceTemplate& face = faceTemplate();
  FaceMatch match = glanceAtFace(surface, frame);
  constexpr int kRounds = 3;
  for (int round = 0; round < kRounds; ++round)
    match = glanceAtFace(surface, bettered(match.frame, match, match.relief, face.mask[0]));
  const ReliefFlow coarse = match.flow;
  match.relief = renderRelief(surface, match.frame, kFinePixel);
  match.flow = registerReliefs(face.relief[1], match.relief, face.mask[1], kFineLevels, &coarse);
  judge(match, 1);
  return match;
}

std::vector<double> likenessAround(const FaceMatch& match, std::span<const Eigen::Vector2d> points, double radius) {
  const FaceTemplate& face = faceTemplate();
  const std::size_t level = match.relief.pixel < (kCoarsePixel + kFinePixel) / 2 ? 1 : 0;
  std::vector<Grid> windows;
  for (const Eigen::Vector2d& p : points) windows.push_back(softWindow(match.relief, p, radius));
  const std::vector<ReliefLikeness> likeness =
      compareReliefs(face.relief[level], match.relief, windows, match.flow, kComparedAt);
  std::vector<double> result;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector2d q = match.flow.carry(points[i]);
    const Eigen::Vector2d at = Relief::pixelsOf(q.x(), q.y(), match.relief.pixel);
    const double seen = match.relief.seen.sample(static_cast<float>(at.x()), static_cast<float>(at.y()));
    result.push_back(std::clamp(seen * likeness[i].mean(), 0.0, 1.0));
  }
  return result;
}

}  // namespace volto::rig
