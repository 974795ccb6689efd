#include "rig/fitting/fit_points.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <variant>

#include <Eigen/Geometry>

#include "rig/closest_point.h"
#include "rig/control_mask.h"
#include "rig/fitting/landmark_checks.h"
#include "rig/fitting/mirror_image.h"
#include "rig/fitting/openings.h"
#include "rig/fitting/registration.h"
#include "rig/fitting/target_surface.h"
#include "rig/fitting/visible_triangles.h"
#include "rig/parallel.h"
#include "rig/skin.h"
#include "rig/weld.h"

namespace volto::rig {

const std::array<std::string_view, 10> kTenPoints = {"3.7", "3.12", "4.3", "4.4",  "9.3",
                                                     "8.3", "8.4",  "2.1", "10.7", "10.8"};

namespace {

// How much farther away the surface's midline may be than the surface.
constexpr double kBesideMiddle_es = 0.3;
// A point less sure than this should be looked at.
constexpr double kDoubtful = 0.5;
// The expected error, in eye separations, at which confidence is one half.
constexpr double kHalfConfidence_es = 0.1;

std::string idOf(std::size_t p) { return std::string(featurePoints()[p].id); }

bool isLoopPoint(std::size_t p) {
  const MaskLoops& loops = maskLoops();
  const auto in = [&](const auto& loop) { return std::find(loop.begin(), loop.end(), p) != loop.end(); };
  return in(loops.left_eye) || in(loops.right_eye) || in(loops.mouth);
}

void requireUsable(const Mesh& mesh, const FeaturePointChoices& given, std::span<const RoughPoint> rough) {
  if (mesh.vertexCount() == 0 || mesh.polygonCount() == 0)
    throw InputError("the mesh has no faces; nothing can be fitted");
  if (!mesh.positions.allFinite()) throw InputError("a vertex of the mesh has a position that is not finite");
  for (const std::uint32_t v : mesh.corner_vertices)
    if (v >= mesh.vertexCount())
      throw InputError("a polygon of the mesh names vertex " + std::to_string(v) + ", the mesh has " +
                       std::to_string(mesh.vertexCount()));
  for (const auto& [p, choice] : given) {
    if (p >= kFeaturePointCount)
      throw InputError("feature point number " + std::to_string(p) + " is not one of the 84");
    if (const auto* vertex = std::get_if<std::uint32_t>(&choice)) {
      if (*vertex >= mesh.vertexCount())
        throw InputError("feature point " + idOf(p) + " is vertex " + std::to_string(*vertex) + ", the mesh has " +
                         std::to_string(mesh.vertexCount()) + " (counted from 0)");
    } else if (!std::get<Eigen::Vector3d>(choice).allFinite()) {
      throw InputError("feature point " + idOf(p) + " has a position that is not finite");
    }
  }
  for (const RoughPoint& r : rough)
    if (r.feature_point >= kFeaturePointCount || !r.position.allFinite() || !(r.sigma_es > 0))
      throw InputError("a rough point is not one of the 84, not finite or without a deviation");
}

// The head in its own frame: which components are skin, which way is out, where the landmarks lie.
class Target {
 public:
  Target(const Mesh& mesh, const FeaturePointChoices& given, std::span<const RoughPoint> rough)
      : mesh_(mesh), skin_(prepareSkin(mesh, weldSeams(mesh, {}))) {
    const ClosestPoint surface(mesh_.positions, skin_.triangles);
    if (surface.empty()) throw InputError("every face of the mesh is degenerate; nothing can be fitted");
    chooseComponents(surface, given, rough);
    for (const auto& t : skin_.triangles)
      if (is_skin_[skin_.component[t[0]]]) triangles_.push_back(t);
    inside_out_ = signedVolume() < 0;
    if (inside_out_)
      for (auto& t : triangles_) std::swap(t[1], t[2]);
    placeLandmarks(given, rough);
  }

  bool insideOut() const { return inside_out_; }
  const std::vector<PlacedLandmark>& landmarks() const { return landmarks_; }
  const std::vector<std::array<std::uint32_t, 3>>& triangles() const { return triangles_; }

  // `outside`: only what is seen from outside.
  TargetSurface inFrameOf(const Similarity& mesh_from_generic, bool outside) const {
    VertexPositions positions(mesh_.positions.rows(), 3);
    for (Eigen::Index v = 0; v < positions.rows(); ++v)
      positions.row(v) = mesh_from_generic.inverse(mesh_.positions.row(v)).transpose();
    if (!outside) return {std::move(positions), triangles_};
    const std::vector<bool> visible = visibleTriangles(positions, triangles_);
    std::vector<std::array<std::uint32_t, 3>> seen;
    for (std::size_t t = 0; t < triangles_.size(); ++t)
      if (visible[t]) seen.push_back(triangles_[t]);
    if (seen.empty())
      throw InputError("nothing of the mesh is seen from where the feature points say that its face is");
    return {std::move(positions), std::move(seen)};
  }

 private:
  // The component that most landmarks are nearest to, and every one of which a vertex was chosen.
  void chooseComponents(const ClosestPoint& surface, const FeaturePointChoices& given,
                        std::span<const RoughPoint> rough) {
    const std::size_t components = 1 + *std::max_element(skin_.component.begin(), skin_.component.end());
    std::vector<std::size_t> votes(components, 0), size(components, 0);
    is_skin_.assign(components, false);
    for (const auto& t : skin_.triangles) ++size[skin_.component[t[0]]];
    const auto vote = [&](const Eigen::Vector3d& at) {
      const SurfacePoint nearest = surface.find(at);
      if (nearest.triangle >= 0) ++votes[skin_.component[surface.triangle(nearest.triangle)[0]]];
    };
    for (const auto& [p, choice] : given) {
      if (const auto* vertex = std::get_if<std::uint32_t>(&choice)) {
        const std::uint32_t c = skin_.component[*vertex];
        ++votes[c];
        is_skin_[c] = size[c] > 0;
      } else {
        vote(std::get<Eigen::Vector3d>(choice));
      }
    }
    for (const RoughPoint& r : rough) vote(r.position);
    std::size_t best = 0;
    for (std::size_t c = 1; c < components; ++c)
      if (votes[c] > votes[best] || (votes[c] == votes[best] && size[c] > size[best])) best = c;
    is_skin_[best] = true;
  }

  double signedVolume() const {
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    double total = 0, volume = 0;
    const auto corner = [&](const std::array<std::uint32_t, 3>& t, std::size_t i) -> Eigen::Vector3d {
      return mesh_.positions.row(t[i]);
    };
    for (const auto& t : triangles_) {
      const double area = (corner(t, 1) - corner(t, 0)).cross(corner(t, 2) - corner(t, 0)).norm();
      centre += area * (corner(t, 0) + corner(t, 1) + corner(t, 2)) / 3;
      total += area;
    }
    if (!(total > 0)) return 0;
    centre /= total;
    for (const auto& t : triangles_)
      volume += (corner(t, 0) - centre).dot((corner(t, 1) - centre).cross(corner(t, 2) - centre));
    return volume;
  }

  void placeLandmarks(const FeaturePointChoices& given, std::span<const RoughPoint> rough) {
    const ClosestPoint surface(mesh_.positions, triangles_);
    const double turn = inside_out_ ? -1 : 1;
    const auto place = [&](std::size_t p, const Eigen::Vector3d& at, double sigma) {
      PlacedLandmark landmark{p, at, Eigen::Vector3d::Zero(), 0, sigma};
      const SurfacePoint nearest = surface.find(at);
      landmark.off_surface = nearest.distance;
      for (std::size_t i = 0; i < 3; ++i)
        landmark.normal +=
            turn * nearest.barycentric[i] * skin_.normals.row(surface.triangle(nearest.triangle)[i]).transpose();
      landmark.normal.normalize();
      landmarks_.push_back(landmark);
    };
    for (const auto& [p, choice] : given) {
      const auto* vertex = std::get_if<std::uint32_t>(&choice);
      place(p, vertex != nullptr ? Eigen::Vector3d(mesh_.positions.row(*vertex)) : std::get<Eigen::Vector3d>(choice),
            0);
    }
    for (const RoughPoint& r : rough)
      if (!given.contains(r.feature_point)) place(r.feature_point, r.position, r.sigma_es);
  }

  const Mesh& mesh_;
  Skin skin_;
  std::vector<bool> is_skin_;  // per component
  std::vector<std::array<std::uint32_t, 3>> triangles_;
  std::vector<PlacedLandmark> landmarks_;
  bool inside_out_ = false;
};

Eigen::Vector3d placeOn(const VertexPositions& positions, const SurfacePlace& place) {
  Eigen::Vector3d out = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < 3; ++i) out += place.weights[i] * positions.row(place.vertices[i]).transpose();
  return out;
}

SurfacePlace placeOf(const TargetSurface& target, const SurfaceHit& hit) {
  return {target.triangle(hit.triangle), hit.barycentric};
}

// The nearest point that looks the same way, unless one that does not quite is much nearer.
SurfaceHit readOff(const TargetSurface& target, const Eigen::Vector3d& at, const Eigen::Vector3d& normal) {
  const SurfaceHit alike = target.find(at, normal, 0.3, 0.3), near = target.find(at, normal, -0.2, 0.3);
  if (alike.triangle >= 0 && alike.distance < 2 * near.distance + 0.03) return alike;
  if (near.triangle >= 0) return near;
  return target.find(at, normal, -2, std::numeric_limits<double>::infinity());
}

// A point on the target. Points of the loops (lids, inner lips) are vertices where the mesh is fine enough: a position
// between lips that touch would belong to both.
FeaturePointChoice choiceFor(std::size_t p, const TargetSurface& target, const SurfaceHit& hit, const Similarity& frame,
                             std::vector<bool>& vertex_taken) {
  const auto& t = target.triangle(hit.triangle);
  std::size_t nearest = 0;
  double distance = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < 3; ++i) {
    const double d = (target.positions().row(t[i]).transpose() - hit.position).norm();
    if (d < distance && !vertex_taken[t[i]]) {
      distance = d;
      nearest = i;
    }
  }
  if (distance < (isLoopPoint(p) ? 0.03 : 0.005)) {
    vertex_taken[t[nearest]] = true;
    return t[nearest];
  }
  return Eigen::Vector3d(frame(hit.position));
}

// Where lips or lids touch, the nearest surface may be the opposite one. A point that came out on the wrong side of the
// one it faces is read off again, nearest surface first, and put directly beside the other when that is wrong too.
void keepSidesApart(const RegisteredFace& face, const GenericHead& head, const TargetSurface& target,
                    const Similarity& frame, const VertexPositions& normals, const FeaturePointChoices& given,
                    std::vector<bool>& vertex_taken, FittedPoints& out) {
  constexpr std::array<std::pair<std::string_view, std::string_view>, 9> kFacing = {{{"2.2", "2.3"},
                                                                                     {"2.6", "2.8"},
                                                                                     {"2.7", "2.9"},
                                                                                     {"3.1", "3.3"},
                                                                                     {"3.2", "3.4"},
                                                                                     {"12.5", "12.7"},
                                                                                     {"12.6", "12.8"},
                                                                                     {"12.9", "12.11"},
                                                                                     {"12.10", "12.12"}}};
  constexpr double kBeside = 0.002;  // eye separations
  const auto placeNow = [&](std::size_t p) {
    const FeaturePointChoice& choice = out.points.at(p);
    if (const auto* vertex = std::get_if<std::uint32_t>(&choice))
      return Eigen::Vector3d(target.positions().row(*vertex));
    return Eigen::Vector3d(frame.inverse(std::get<Eigen::Vector3d>(choice)));
  };
  for (const auto& [upper_id, lower_id] : kFacing) {
    const std::size_t upper = featurePointIndex(upper_id).value(), lower = featurePointIndex(lower_id).value();
    const Eigen::Vector3d upper_at = placeNow(upper), lower_at = placeNow(lower);
    if (upper_at.y() >= lower_at.y() || (given.contains(upper) && given.contains(lower))) continue;
    const auto off = [&](std::size_t p, const Eigen::Vector3d& at) {
      return (at - placeOn(face.positions, head.points[p])).norm();
    };
    const bool lower_is_wrong =
        !given.contains(lower) && (given.contains(upper) || off(lower, lower_at) > off(upper, upper_at));
    const std::size_t wrong = lower_is_wrong ? lower : upper;
    const Eigen::Vector3d& right_at = lower_is_wrong ? upper_at : lower_at;
    const double side = lower_is_wrong ? -1 : 1;
    const SurfaceHit hit =
        target.find(placeOn(face.positions, head.points[wrong]), placeOn(normals, head.points[wrong]).normalized(), -2,
                    std::numeric_limits<double>::infinity());
    FeaturePointChoice choice = choiceFor(wrong, target, hit, frame, vertex_taken);
    out.points[wrong] = choice;
    if (side * (placeNow(wrong).y() - right_at.y()) <= 0)
      out.points[wrong] = Eigen::Vector3d(frame(right_at + Eigen::Vector3d(0, side * kBeside, 0)));
    out.confidence[wrong] /= 2;
    if (out.confidence[wrong] < kDoubtful &&
        std::find(out.to_check.begin(), out.to_check.end(), wrong) == out.to_check.end())
      out.to_check.push_back(wrong);
  }
}

// Against one squared eye separation of surface.
double pinWeight(double sigma_es) { return sigma_es > 0 ? 0.01 / (sigma_es * sigma_es) * 0.05 : 20.0; }

VertexPositions warped(const LandmarkWarp& warp, const VertexPositions& positions) {
  VertexPositions out(positions.rows(), 3);
  for (Eigen::Index v = 0; v < out.rows(); ++v) out.row(v) = warp(positions.row(v)).transpose();
  return out;
}

// The margins that are seen of each eye and of the mouth, where the fit so far misses one of them by more than heads
// differ in what is called a margin.
std::vector<SeenMargin> marginsMissed(const RegisteredFace& face, const GenericHead& head, const VertexPositions& skin,
                                      const std::vector<std::array<std::uint32_t, 3>>& triangles,
                                      const std::vector<PlacedLandmark>& landmarks) {
  constexpr double kMissed_es = 0.07;
  FeaturePointPositions points;
  for (std::size_t p = 0; p < kFeaturePointCount; ++p)
    points.row(static_cast<Eigen::Index>(p)) = placeOn(face.positions, head.points[p]).transpose();
  std::array<bool, kFeaturePointCount> known{};
  for (const PlacedLandmark& l : landmarks) known[l.feature_point] = l.sigma_es == 0;
  std::vector<SeenMargin> margins = seenMargins(skin, triangles, points, known);
  std::array<bool, 3> missed{};
  for (const SeenMargin& m : margins)
    if ((m.position - points.row(static_cast<Eigen::Index>(m.feature_point)).transpose()).norm() > kMissed_es)
      missed[static_cast<std::size_t>(m.of)] = true;
  std::erase_if(margins, [&](const SeenMargin& m) { return !missed[static_cast<std::size_t>(m.of)]; });
  return margins;
}

std::vector<CorrespondingPlace> denseCorrespondence(const GenericHead& head, const VertexPositions& start,
                                                    const LandmarkWarp& warp, const RegisteredFace& face,
                                                    const TargetSurface& target, const TargetSurface& all_skin) {
  std::vector<CorrespondingPlace> out(head.mesh.vertexCount());
  const auto set = [&](std::size_t v, const TargetSurface& surface, const SurfaceHit& hit) {
    if (hit.triangle < 0) return;
    out[v] = {placeOf(surface, hit), hit.distance, 1 / (1 + std::pow(hit.distance / 0.05, 2))};
  };
  std::vector<bool> done(out.size(), false);
  for (std::size_t v = 0; v < head.vertex_of_face.size(); ++v) {
    done[head.vertex_of_face[v]] = true;
    set(head.vertex_of_face[v], target, face.hits[v]);
  }
  // The rest of the skin goes on as the face does.
  constexpr std::size_t kSamples = 150;
  std::vector<WarpLandmark> samples;
  const std::size_t step = std::max<std::size_t>(1, head.vertex_of_face.size() / kSamples);
  for (std::size_t v = 0; v < head.vertex_of_face.size(); v += step) {
    const auto row = static_cast<Eigen::Index>(v);
    samples.push_back({start.row(row), face.positions.row(row), 0.01});
  }
  const LandmarkWarp onward(std::move(samples));
  VertexPositions all(head.mesh.positions.rows(), 3);
  for (Eigen::Index v = 0; v < all.rows(); ++v)
    if (!done[static_cast<std::size_t>(v)] && head.skin[static_cast<std::size_t>(v)])
      all.row(v) = onward(warp(head.mesh.positions.row(v))).transpose();
    else
      all.row(v) = head.mesh.positions.row(v);
  for (std::size_t v = 0; v < head.vertex_of_face.size(); ++v)
    all.row(head.vertex_of_face[v]) = face.positions.row(static_cast<Eigen::Index>(v));
  const VertexPositions normals = faceNormals(triangulate(head.mesh), all);
  for (Eigen::Index v = 0; v < all.rows(); ++v)
    if (!done[static_cast<std::size_t>(v)] && head.skin[static_cast<std::size_t>(v)])
      set(static_cast<std::size_t>(v), all_skin, all_skin.find(all.row(v), normals.row(v), 0.2, 0.3));
  return out;
}

FacePoints pointsOf(const GenericHead& head, const RegisteredFace& face, const VertexPositions& normals) {
  FacePoints out;
  for (std::size_t p = 0; p < kFeaturePointCount; ++p) {
    out.positions.row(static_cast<Eigen::Index>(p)) = placeOn(face.positions, head.points[p]).transpose();
    out.normals.row(static_cast<Eigen::Index>(p)) = placeOn(normals, head.points[p]).normalized().transpose();
  }
  return out;
}

FeaturePointPositions normalsAtPoints(const GenericHead& head,
                                      const std::vector<std::array<std::uint32_t, 3>>& face_triangles) {
  const VertexPositions normals = faceNormals(face_triangles, head.face.positions);
  FeaturePointPositions out;
  for (std::size_t p = 0; p < kFeaturePointCount; ++p)
    out.row(static_cast<Eigen::Index>(p)) = placeOn(normals, head.points[p]).normalized().transpose();
  return out;
}

}  // namespace

CheckedPoints checkPoints(const Mesh& mesh, const FeaturePointChoices& given) {
  constexpr double kFarOff_es = 0.5;  // and three times as far as is usual on this face
  requireUsable(mesh, given, {});
  std::optional<Target> prepared;
  parallelFor(2, [&](std::size_t which) {
    if (which == 0)
      prepared.emplace(mesh, given, std::span<const RoughPoint>());
    else
      genericHead();  // the first to ask for it waits until it is bent
  });
  const Target& on_mesh = *prepared;
  const GenericHead& head = genericHead();
  std::vector<PlacedLandmark> landmarks = on_mesh.landmarks();
  FacePlacement placed = placeFace(landmarks, head.human.points, normalsAtPoints(head, triangulate(head.face)), on_mesh.insideOut());
  CheckedPoints out{{}, std::move(placed.notes)};
  for (const auto& [p, choice] : given)
    out.points.emplace(placed.sides_exchanged ? featurePoints()[p].mirror : p, choice);
  std::vector<double> off;
  for (const PlacedLandmark& l : landmarks)
    off.push_back((placed.mesh_from_generic.inverse(l.position) -
                   head.human.points.row(static_cast<Eigen::Index>(l.feature_point)).transpose())
                      .norm());
  std::vector<double> sorted = off;
  std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2), sorted.end());
  std::string doubtful;
  for (std::size_t i = 0; i < off.size(); ++i)
    if (off[i] > kFarOff_es && off[i] > 3 * sorted[sorted.size() / 2])
      doubtful.append(1, ' ').append(featurePoints()[landmarks[i].feature_point].id);
  if (!doubtful.empty()) out.notes.push_back("far from where the other points have it on a human face; check" + doubtful);
  return out;
}

FittedPoints fitPoints(const Mesh& mesh, const FeaturePointChoices& given, std::span<const RoughPoint> rough,
                       const FitOptions& options) {
  requireUsable(mesh, given, rough);
  const Target on_mesh(mesh, given, rough);
  const GenericHead& head = options.head != nullptr ? *options.head : genericHead();
  const HumanFace& human = head.human;

  const std::vector<std::array<std::uint32_t, 3>> face_triangles = triangulate(head.face);
  const FeaturePointPositions generic_normals = normalsAtPoints(head, face_triangles);

  FittedPoints out;
  std::vector<PlacedLandmark> landmarks = on_mesh.landmarks();
  FacePlacement placed = placeFace(landmarks, human.points, generic_normals, on_mesh.insideOut());
  const Similarity& frame = placed.mesh_from_generic;
  out.notes = std::move(placed.notes);
  const TargetSurface target = on_mesh.inFrameOf(frame, true);

  // What is known of one side of a face that is its own mirror image is known of the other.
  constexpr double kFace_es = 1.3;
  const std::optional<MirrorPlane> mirror = findMirrorPlane(target, human.points.colwise().mean().transpose(), kFace_es);
  if (mirror)
    addMirrorImages(*mirror, frame, landmarks);

  // Landmarks to landmarks, then surface to surface.
  std::vector<WarpLandmark> pairs;
  for (const PlacedLandmark& l : landmarks)
    pairs.push_back(
        {human.points.row(static_cast<Eigen::Index>(l.feature_point)), frame.inverse(l.position), l.sigma_es});
  std::vector<FacePin> pins;
  for (const PlacedLandmark& l : landmarks)
    pins.push_back({head.points[l.feature_point], frame.inverse(l.position), pinWeight(l.sigma_es)});
  LandmarkWarp warp(pairs);
  VertexPositions start = warped(warp, head.face.positions);
  RegisteredFace face = registerFace(head, start, target, pins);

  // Lids and lips that come to lie beside the edges that are seen: those edges are landmarks too, and all once more.
  const TargetSurface all_skin = on_mesh.inFrameOf(frame, false);
  if (const std::vector<SeenMargin> margins = marginsMissed(face, head, all_skin.positions(), on_mesh.triangles(), landmarks);
      !margins.empty()) {
    for (const SeenMargin& m : margins) {
      pairs.push_back({human.points.row(static_cast<Eigen::Index>(m.feature_point)), m.position, m.sigma_es});
      pins.push_back({head.points[m.feature_point], m.position, pinWeight(m.sigma_es)});
    }
    warp = LandmarkWarp(pairs);
    start = warped(warp, head.face.positions);
    face = registerFace(head, start, target, pins);
  }
  const VertexPositions normals = faceNormals(face_triangles, face.positions);

  FacePoints read = pointsOf(head, face, normals);
  if (mirror) read = alikeOnBothSides(read, *mirror, frame, landmarks);
  std::vector<bool> vertex_taken(mesh.vertexCount(), false);
  for (const auto& [p, choice] : given)
    if (const auto* vertex = std::get_if<std::uint32_t>(&choice)) vertex_taken[*vertex] = true;
  for (const auto& [p, choice] : given)
    out.points.emplace(placed.sides_exchanged ? featurePoints()[p].mirror : p, choice);
  for (std::size_t p = 0; p < kFeaturePointCount; ++p) {
    if (out.points.contains(p)) {
      out.confidence[p] = 1;
      continue;
    }
    const auto row = static_cast<Eigen::Index>(p);
    SurfaceHit hit = readOff(target, read.positions.row(row), read.normals.row(row));
    if (mirror && featurePoints()[p].mirror == p) {
      // In a groove what is nearest to the middle lies beside it.
      const SurfaceHit middle = findOnPlane(target, *mirror, read.positions.row(row), read.normals.row(row));
      if (middle.distance < hit.distance + kBesideMiddle_es) hit = middle;
    }
    out.points.emplace(p, choiceFor(p, target, hit, frame, vertex_taken));
    const double deviation = 0.75 * warp.deviation(human.points.row(static_cast<Eigen::Index>(p)));
    const bool neighbour_given = std::any_of(given.begin(), given.end(), [p](const auto& g) {
      return featurePoints()[g.first].region == featurePoints()[p].region;
    });
    const double spread = neighbour_given ? human.spread[p] : std::max(human.spread[p], human.spread_unseen[p]);
    const double error2 = spread * spread + deviation * deviation + hit.distance * hit.distance;
    out.confidence[p] = 1 / (1 + error2 / (kHalfConfidence_es * kHalfConfidence_es));
    if (out.confidence[p] < kDoubtful) out.to_check.push_back(p);
  }
  keepSidesApart(face, head, target, frame, normals, given, vertex_taken, out);
  for (const auto& [p, choice] : out.points) {
    const auto* vertex = std::get_if<std::uint32_t>(&choice);
    out.positions.row(static_cast<Eigen::Index>(p)) =
        vertex != nullptr ? Eigen::RowVector3d(mesh.positions.row(*vertex))
                          : Eigen::RowVector3d(std::get<Eigen::Vector3d>(choice).transpose());
  }
  std::stable_sort(out.to_check.begin(), out.to_check.end(),
                   [&](std::size_t a, std::size_t b) { return out.confidence[a] < out.confidence[b]; });
  out.folded_triangles = face.folded;
  out.dense = denseCorrespondence(head, start, warp, face, target, all_skin);
  return out;
}

}  // namespace volto::rig
