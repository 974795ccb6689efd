#include "rig/association.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

#include "rig/closest_point.h"
#include "rig/parallel.h"

namespace volto::rig {
namespace {

constexpr double kRayLimitEs = 0.4;
constexpr double kNearEs = 0.03;
constexpr std::size_t kChunk = 512;

struct MaskFace {
  Eigen::Vector3d a, ab, ac, normal;
  MaskGeometry::Triangle points;
  SlitSide side;
};

std::vector<MaskFace> maskFaces(const MaskGeometry& mask) {
  std::vector<MaskFace> faces;
  for (std::size_t t = 0; t < mask.triangles.size(); ++t) {
    const auto& ids = mask.triangles[t];
    const Eigen::Vector3d a = mask.points.row(ids[0]), b = mask.points.row(ids[1]), c = mask.points.row(ids[2]);
    faces.push_back({a, b - a, c - a, (b - a).cross(c - a), ids, mask.triangle_side[t]});
  }
  return faces;
}

struct Hit {
  double distance = 0;  // along the line, without sign
  std::array<double, 3> barycentric{};
};

// The line through p along n against a triangle. A little beyond the edges still counts, so that no gap opens between
// triangles.
bool intersect(const MaskFace& face, const Eigen::Vector3d& p, const Eigen::Vector3d& n, Hit& hit) {
  const double facing = n.dot(face.normal);
  if (facing <= 0) return false;  // angle of 90 degrees or more
  const double s = face.normal.dot(face.a - p) / facing;
  const Eigen::Vector3d q = p + s * n - face.a;
  const double area2 = face.normal.squaredNorm();
  const double v = face.normal.dot(q.cross(face.ac)) / area2;
  const double w = face.normal.dot(face.ab.cross(q)) / area2;
  const double u = 1 - v - w;
  constexpr double kSlack = -1e-6;
  if (!(u >= kSlack && v >= kSlack && w >= kSlack)) return false;
  hit.distance = std::abs(s);
  hit.barycentric = {std::max(u, 0.0), std::max(v, 0.0), std::max(w, 0.0)};
  return true;
}

// A place of the skin: a vertex, or somewhere between two.
struct Place {
  Eigen::Vector3d at, normal;
  std::array<float, kFeaturePointCount> distance;  // along the skin, from the feature points
};

// Where the mask covers a place, if it does.
struct Cover {
  std::int16_t triangle = -1;
  bool by_ray = false;
  SlitSide side = SlitSide::none;
  std::array<double, 3> barycentric{};

  bool found() const { return triangle >= 0; }
  // Skin that belongs together: covered from the same side of the same slit, or not covered.
  bool sameKind(const Cover& other) const { return found() == other.found() && side == other.side; }
};

class Associator {
 public:
  Associator(const Mesh& mesh, const Skin& skin, const MaskGeometry& mask, double eye_separation, SkinAssociation& out)
      : mesh_(mesh), skin_(skin), mask_(mask), es_(eye_separation), faces_(maskFaces(mask)), out_(out) {}

  Cover cover(std::uint32_t v) const { return coverAt(placeOf(v)); }

  // How far from `a` towards its neighbour `b` what `a` is goes on, as a share of the edge.
  double extent(std::uint32_t a, const Cover& of_a, std::uint32_t b) const {
    const Place from = placeOf(a), to = placeOf(b);
    const auto length = static_cast<float>((to.at - from.at).norm());
    double same = 0, other = 1;
    for (int halving = 0; halving < 6; ++halving) {
      const double t = 0.5 * (same + other);
      Place place;
      place.at = (1 - t) * from.at + t * to.at;
      place.normal = ((1 - t) * from.normal + t * to.normal).normalized();
      for (std::size_t p = 0; p < kFeaturePointCount; ++p)
        place.distance[p] = std::min(from.distance[p] + static_cast<float>(t) * length,
                                     to.distance[p] + static_cast<float>(1 - t) * length);
      (coverAt(place).sameKind(of_a) ? same : other) = t;
    }
    return 0.5 * (same + other);
  }

  // The triangle at the feature point with the shortest path; of those, the one whose other points are nearest.
  void byPath(std::uint32_t v, std::size_t nearest, const RegionsOfInfluence& regions) {
    const auto distances = out_.point_distance.row(v);
    double best = std::numeric_limits<double>::infinity();
    const SlitSide side = mask_.point_side[nearest];
    for (const std::uint8_t t : regions.triangles_of_point[nearest]) {
      if (opposite(side, faces_[t].side)) continue;
      double sum = 0;
      for (const std::uint16_t q : faces_[t].points) sum += std::min<double>(distances[q], 10 * es_);
      if (sum >= best) continue;
      best = sum;
      out_.triangle[v] = t;
      for (int i = 0; i < 3; ++i) out_.barycentric[v][i] = faces_[t].points[i] == nearest ? 1.0 : 0.0;
    }
    out_.kind[v] = AssociationKind::geodesic;
    out_.side[v] = side;
  }

 private:
  Place placeOf(std::uint32_t v) const {
    Place place{mesh_.positions.row(v), skin_.normals.row(v), {}};
    const auto row = out_.point_distance.row(v);
    std::copy(row.data(), row.data() + kFeaturePointCount, place.distance.begin());
    return place;
  }

  Cover coverAt(const Place& place) const {
    const Cover cover = byRay(place);
    return cover.found() ? cover : byNearness(place);
  }

  // The closest triangle that the place's normal meets, that faces the same way, on the same lip or lid, and that is
  // near along the skin.
  Cover byRay(const Place& place) const {
    Cover cover;
    if (!(place.normal.squaredNorm() > 0)) return cover;
    double best = kRayLimitEs * es_;
    for (std::size_t t = 0; t < faces_.size(); ++t) {
      Hit hit;
      if (!intersect(faces_[t], place.at, place.normal, hit) || hit.distance >= best) continue;
      if (onOtherSide(place, faces_[t].side) || !nearAlongSkin(place, faces_[t], hit)) continue;
      best = hit.distance;
      cover = {static_cast<std::int16_t>(t), true, faces_[t].side, hit.barycentric};
    }
    return cover;
  }

  // Where the normal just misses the mask (at its outline, at the margins of lids and lips) but the mask is there all
  // the same: the nearest point of it, under the same conditions.
  Cover byNearness(const Place& place) const {
    Cover cover;
    double best = kNearEs * es_;
    for (std::size_t t = 0; t < faces_.size(); ++t) {
      const MaskFace& face = faces_[t];
      if (place.normal.dot(face.normal) <= 0) continue;
      const SurfacePoint nearest = closestPointOnTriangle(place.at, face.a, face.a + face.ab, face.a + face.ac);
      const Hit hit{nearest.distance, nearest.barycentric};
      if (nearest.distance >= best || onOtherSide(place, face.side) || !nearAlongSkin(place, face, hit)) continue;
      best = nearest.distance;
      cover = {static_cast<std::int16_t>(t), false, face.side, nearest.barycentric};
    }
    return cover;
  }

  bool onOtherSide(const Place& place, SlitSide side) const {
    if (side == SlitSide::none) return false;
    float own = kUnreached, other = kUnreached;
    for (std::size_t p = 0; p < kFeaturePointCount; ++p) {
      const SlitSide of_point = mask_.point_side[p];
      if (of_point == side) own = std::min(own, place.distance[p]);
      if (opposite(of_point, side)) other = std::min(other, place.distance[p]);
    }
    return other < 0.6F * own;  // beside a corner both are about as near, and either will do
  }

  bool nearAlongSkin(const Place& place, const MaskFace& face, const Hit& hit) const {
    const Eigen::Vector3d q = face.a + hit.barycentric[1] * face.ab + hit.barycentric[2] * face.ac;
    for (const std::uint16_t p : face.points) {
      const double air = (mask_.points.row(p).transpose() - q).norm();
      if (place.distance[p] > 2.2 * air + 2.0 * hit.distance + 0.08 * es_) return false;
    }
    return true;
  }

  const Mesh& mesh_;
  const Skin& skin_;
  const MaskGeometry& mask_;
  double es_;
  std::vector<MaskFace> faces_;
  SkinAssociation& out_;
};

// In the corner of an eye or of the mouth rays of some folds meet the opposite side. A lip or lid is one piece with the
// points on it; what is not connected to them is covered by neither side.
void dropIslands(const Skin& skin, const MaskGeometry& mask, const SkinPoints& on_skin, std::vector<Cover>& covers) {
  std::vector<std::uint8_t> connected(covers.size(), 0);
  std::vector<std::uint32_t> stack;
  for (std::size_t p = 0; p < on_skin.size(); ++p) {
    const SlitSide side = mask.point_side[p];
    if (side == SlitSide::none) continue;
    for (const GeodesicSource& s : on_skin[p].around) {
      stack.push_back(s.vertex);
      connected[s.vertex] = 1;
    }
    while (!stack.empty()) {
      const std::uint32_t v = stack.back();
      stack.pop_back();
      for (std::uint32_t e = skin.graph.start[v]; e < skin.graph.start[v + 1]; ++e) {
        const std::uint32_t u = skin.graph.neighbour[e];
        if (connected[u] != 0 || !covers[u].found() || covers[u].side != side) continue;
        connected[u] = 1;
        stack.push_back(u);
      }
    }
  }
  for (std::size_t v = 0; v < covers.size(); ++v)
    if (covers[v].found() && covers[v].side != SlitSide::none && connected[v] == 0) covers[v] = Cover{};
}

}  // namespace

SkinAssociation associateSkin(const Mesh& mesh, const Skin& skin, const std::vector<bool>& is_skin,
                              const MaskGeometry& mask, const SkinPoints& on_skin, double eye_separation,
                              double fade_out) {
  const std::size_t vertices = mesh.vertexCount();
  SkinAssociation out;
  out.triangle.assign(vertices, -1);
  out.kind.assign(vertices, AssociationKind::outside);
  out.on_mask.assign(vertices, false);
  out.barycentric.assign(vertices, {0, 0, 0});
  out.side.assign(vertices, SlitSide::none);
  out.beyond.assign(vertices, kUnreached);
  out.point_distance.setConstant(static_cast<Eigen::Index>(vertices), static_cast<Eigen::Index>(kFeaturePointCount),
                                 kUnreached);

  // Far enough for what is asked of it: whether a ray to one of the point's triangles is near along the skin too, and
  // how far the opposite lip or lid is in comparison.
  std::array<float, kFeaturePointCount> limit{};
  for (const MaskGeometry::Triangle& t : mask.triangles)
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint16_t a = t[i], b = t[(i + 1) % 3];
      const auto reach = static_cast<float>(2.2 * (mask.points.row(a) - mask.points.row(b)).norm() + eye_separation);
      for (const std::uint16_t p : {a, b}) limit[p] = std::max(limit[p], reach);
    }
  out.reach = *std::min_element(limit.begin(), limit.end());
  parallelFor(kFeaturePointCount, [&](std::size_t p) {
    const GeodesicDistances d = geodesicDistances(skin.graph, on_skin[p].around, limit[p]);
    for (std::size_t v = 0; v < vertices; ++v)
      out.point_distance(static_cast<Eigen::Index>(v), static_cast<Eigen::Index>(p)) = d.distance[v];
  });

  Associator associator(mesh, skin, mask, eye_separation, out);
  const auto isSkin = [&](std::uint32_t v) { return skin.stands(v) && is_skin[skin.component[v]]; };
  std::vector<Cover> covers(vertices);
  parallelFor((vertices + kChunk - 1) / kChunk, [&](std::size_t chunk) {
    for (std::size_t v = chunk * kChunk; v < std::min((chunk + 1) * kChunk, vertices); ++v)
      if (const auto u = static_cast<std::uint32_t>(v); isSkin(u)) covers[v] = associator.cover(u);
  });
  dropIslands(skin, mask, on_skin, covers);
  std::vector<GeodesicSource> covered;
  std::vector<std::uint32_t> left;
  for (std::uint32_t v = 0; v < vertices; ++v) {
    if (!isSkin(v)) continue;
    const Cover& cover = covers[v];
    out.on_mask[v] = cover.found();
    if (!cover.found()) {
      left.push_back(v);
      continue;
    }
    out.triangle[v] = cover.triangle;
    out.barycentric[v] = cover.barycentric;
    out.side[v] = cover.side;
    out.kind[v] = cover.by_ray ? AssociationKind::ray : AssociationKind::geodesic;
    covered.push_back({v, 0.0F});
  }
  std::vector<std::vector<SkinBorder>> borders((vertices + kChunk - 1) / kChunk);
  parallelFor(borders.size(), [&](std::size_t chunk) {
    for (std::size_t v = chunk * kChunk; v < std::min((chunk + 1) * kChunk, vertices); ++v) {
      const auto a = static_cast<std::uint32_t>(v);
      if (!isSkin(a) || !covers[a].found()) continue;
      for (std::uint32_t e = skin.graph.start[a]; e < skin.graph.start[a + 1]; ++e)
        if (const std::uint32_t b = skin.graph.neighbour[e]; !covers[a].sameKind(covers[b]))
          borders[chunk].push_back({a, b, associator.extent(a, covers[a], b), skin.graph.length[e]});
    }
  });
  for (const auto& chunk : borders) out.borders.insert(out.borders.end(), chunk.begin(), chunk.end());
  // The feature points themselves always count as covered, whatever their normals do.
  for (const SkinPoint& point : on_skin)
    for (const GeodesicSource& s : point.around)
      if (!out.on_mask[s.vertex]) covered.push_back(s);
  for (const SkinBorder& border : out.borders)
    if (!out.on_mask[border.outside]) covered.push_back({border.outside, border.left()});
  out.fade_out = static_cast<float>(fade_out);
  out.beyond = surfaceDistances(skin.graph, covered, out.fade_out).distance;
  std::vector<GeodesicSource> sources;
  std::vector<std::size_t> point_of_source;
  for (std::size_t p = 0; p < on_skin.size(); ++p)
    for (const GeodesicSource& s : on_skin[p].around) {
      sources.push_back(s);
      point_of_source.push_back(p);
    }
  const std::vector<std::int32_t> nearest = geodesicDistances(skin.graph, sources).nearest_source;
  const RegionsOfInfluence regions = regionsOfInfluence(mask);
  for (const std::uint32_t v : left)
    if (out.beyond[v] < kUnreached && nearest[v] >= 0)
      associator.byPath(v, point_of_source[static_cast<std::size_t>(nearest[v])], regions);
  return out;
}

}  // namespace volto::rig
