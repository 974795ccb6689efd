#include "rig/fitting/generic_head.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <queue>
#include <variant>

#include <Eigen/Geometry>

#include "rig/build_rig.h"
#include "rig/closest_point.h"
#include "rig/control_mask.h"
#include "rig/fitting/landmark_warp.h"
#include "rig/fitting/target_surface.h"
#include "rig/mesh_io.h"
#include "rig/skin.h"

namespace volto::rig {

extern const char* const kGenericHeadObj;     // rig/assets/volto_head.obj
extern const char* const kGenericHeadPoints;  // rig/assets/volto_head.points.json

namespace {

constexpr double kMargin_es = 0.33;

bool isLoopPoint(std::size_t p) {
  const MaskLoops& loops = maskLoops();
  const auto in = [&](const auto& loop) { return std::find(loop.begin(), loop.end(), p) != loop.end(); };
  return in(loops.left_eye) || in(loops.right_eye) || in(loops.mouth);
}

// Neighbours along the sides of polygons; not across quads, where a way could cross another.
using Sides = std::vector<std::vector<std::uint32_t>>;
Sides polygonSides(const Mesh& mesh) {
  Sides sides(mesh.vertexCount());
  for (std::size_t p = 0; p < mesh.polygonCount(); ++p) {
    const std::uint32_t first = mesh.polygon_start[p], last = mesh.polygon_start[p + 1];
    for (std::uint32_t c = first; c < last; ++c) {
      const std::uint32_t a = mesh.corner_vertices[c], b = mesh.corner_vertices[c + 1 < last ? c + 1 : first];
      sides[a].push_back(b);
      sides[b].push_back(a);
    }
  }
  return sides;
}

// Marks the vertices of the shortest way along the sides from a to b.
void markPath(const Mesh& mesh, const Sides& sides, std::uint32_t a, std::uint32_t b, std::vector<bool>& marked) {
  std::vector<double> distance(sides.size(), std::numeric_limits<double>::infinity());
  std::vector<std::uint32_t> before(sides.size(), a);
  using Entry = std::pair<double, std::uint32_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
  distance[a] = 0;
  queue.push({0.0, a});
  while (!queue.empty()) {
    const auto [d, v] = queue.top();
    queue.pop();
    if (v == b) break;
    if (d > distance[v]) continue;
    for (const std::uint32_t u : sides[v]) {
      const double there = d + (mesh.positions.row(u) - mesh.positions.row(v)).norm();
      if (there < distance[u]) {
        distance[u] = there;
        before[u] = v;
        queue.push({there, u});
      }
    }
  }
  if (!std::isfinite(distance[b])) throw InputError("the generic head's points are not on one component");
  marked[a] = true;
  for (std::uint32_t v = b; v != a; v = before[v]) marked[v] = true;
}

std::uint32_t nearestVertex(const Mesh& mesh, const Eigen::RowVector3d& at, const std::vector<bool>* of = nullptr) {
  std::uint32_t best = 0;
  double best_distance = std::numeric_limits<double>::infinity();
  for (std::uint32_t v = 0; v < mesh.vertexCount(); ++v) {
    if (of != nullptr && !(*of)[v]) continue;
    const double d = (mesh.positions.row(v) - at).squaredNorm();
    if (d < best_distance) {
      best_distance = d;
      best = v;
    }
  }
  return best;
}

template <std::size_t N>
void markLoop(const Mesh& mesh, const Sides& sides, const std::array<std::uint8_t, N>& loop,
              const std::array<std::uint32_t, kFeaturePointCount>& vertex, std::vector<bool>& marked) {
  for (std::size_t i = 0; i < N; ++i) markPath(mesh, sides, vertex[loop[i]], vertex[loop[(i + 1) % N]], marked);
}

void bendToProportions(const HumanFace& human, const FeaturePointPositions& points, Mesh& mesh) {
  std::vector<WarpLandmark> pairs;
  for (std::size_t p = 0; p < kFeaturePointCount; ++p) {
    const auto row = static_cast<Eigen::Index>(p);
    // Points on a line of the face mean the same on every head; others only about.
    const double sigma = isLoopPoint(p) ? 0.002 : 0.005 + human.spread[p] / 15;
    pairs.push_back({points.row(row), human.points.row(row), sigma});
  }
  const Similarity similarity = fitSimilarity(pairs).similarity;
  for (WarpLandmark& pair : pairs) pair.from = similarity(pair.from);
  const LandmarkWarp warp(std::move(pairs));
  for (Eigen::Index v = 0; v < mesh.positions.rows(); ++v)
    mesh.positions.row(v) = warp(similarity(mesh.positions.row(v))).transpose();
}

// Polygons on the outside of the face, over the vertices that are kept.
void cutOutFace(GenericHead& head, const std::array<std::uint32_t, kFeaturePointCount>& vertex) {
  const Mesh& mesh = head.mesh;
  const Sides sides = polygonSides(mesh);
  std::vector<bool> cut(mesh.vertexCount(), false);
  const MaskLoops& loops = maskLoops();
  markLoop(mesh, sides, loops.left_eye, vertex, cut);
  markLoop(mesh, sides, loops.right_eye, vertex, cut);
  markLoop(mesh, sides, loops.mouth, vertex, cut);

  VertexPositions mask_positions = head.human.points;
  std::vector<std::array<std::uint32_t, 3>> mask_triangles;
  for (const MaskTriangle& t : maskTriangles()) mask_triangles.push_back({t[0], t[1], t[2]});
  const ClosestPoint mask(mask_positions, std::move(mask_triangles));
  const auto near = [&](std::uint32_t v) { return mask.find(mesh.positions.row(v), kMargin_es).triangle >= 0; };
  std::vector<bool> outside(mesh.vertexCount(), false);
  std::vector<std::uint32_t> stack{vertex[featurePointIndex("9.3").value()]};
  outside[stack.front()] = true;
  while (!stack.empty()) {
    const std::uint32_t v = stack.back();
    stack.pop_back();
    for (const std::uint32_t u : sides[v]) {
      if (outside[u] || cut[u] || !near(u)) continue;
      outside[u] = true;
      stack.push_back(u);
    }
  }

  constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> new_index(mesh.vertexCount(), kNone);
  head.face.polygon_start.push_back(0);
  for (std::size_t p = 0; p < mesh.polygonCount(); ++p) {
    bool inside_face = true, any = false;
    for (std::uint32_t c = mesh.polygon_start[p]; c < mesh.polygon_start[p + 1]; ++c) {
      const std::uint32_t v = mesh.corner_vertices[c];
      inside_face = inside_face && (outside[v] || cut[v]);
      any = any || outside[v];
    }
    if (!inside_face || !any) continue;
    for (std::uint32_t c = mesh.polygon_start[p]; c < mesh.polygon_start[p + 1]; ++c) {
      const std::uint32_t v = mesh.corner_vertices[c];
      if (new_index[v] == kNone) {
        new_index[v] = static_cast<std::uint32_t>(head.vertex_of_face.size());
        head.vertex_of_face.push_back(v);
      }
      head.face.corner_vertices.push_back(new_index[v]);
    }
    head.face.polygon_start.push_back(static_cast<std::uint32_t>(head.face.corner_vertices.size()));
  }
  head.face.positions.resize(static_cast<Eigen::Index>(head.vertex_of_face.size()), 3);
  for (std::size_t v = 0; v < head.vertex_of_face.size(); ++v)
    head.face.positions.row(static_cast<Eigen::Index>(v)) = mesh.positions.row(head.vertex_of_face[v]);

  // The outside of the nose, not the lining of the nostril behind it: the normals must agree with the mask's.
  FeaturePointPositions mask_normals = FeaturePointPositions::Zero();
  for (const MaskTriangle& t : maskTriangles()) {
    const Eigen::Vector3d corner = head.human.points.row(t[0]);
    const Eigen::Vector3d to_second = head.human.points.row(t[1]).transpose() - corner;
    const Eigen::Vector3d to_third = head.human.points.row(t[2]).transpose() - corner;
    for (const std::uint8_t p : t) mask_normals.row(p) += to_second.cross(to_third).transpose();
  }
  const TargetSurface surface(head.face.positions, triangulate(head.face));
  for (std::size_t p = 0; p < kFeaturePointCount; ++p) {
    if (isLoopPoint(p)) {  // on the very edge
      const std::uint32_t v = new_index[vertex[p]];
      if (v == kNone) throw InputError("the generic head's lids and lips cannot be cut out along its points");
      head.points[p] = {{v, v, v}, {1, 0, 0}};
      continue;
    }
    const auto row = static_cast<Eigen::Index>(p);
    SurfaceHit at = surface.find(head.human.points.row(row), mask_normals.row(row).normalized(), 0.3, 0.3);
    if (at.triangle < 0) at = surface.find(head.human.points.row(row), Eigen::Vector3d::Zero(), -2, 10);
    head.points[p] = {surface.triangle(at.triangle), at.barycentric};
  }
}

// Points were placed on the nearest surface; now the surface comes to them.
void passThroughPoints(GenericHead& head) {
  std::vector<WarpLandmark> pairs;
  for (std::size_t p = 0; p < kFeaturePointCount; ++p) {
    Eigen::RowVector3d at = Eigen::RowVector3d::Zero();
    for (std::size_t i = 0; i < 3; ++i)
      at += head.points[p].weights[i] * head.face.positions.row(head.points[p].vertices[i]);
    pairs.push_back({at.transpose(), head.human.points.row(static_cast<Eigen::Index>(p)), 0.003});
  }
  const LandmarkWarp warp(std::move(pairs));
  for (Mesh* mesh : {&head.mesh, &head.face})
    for (Eigen::Index v = 0; v < mesh->positions.rows(); ++v)
      mesh->positions.row(v) = warp(mesh->positions.row(v)).transpose();
}

GenericHead bentHead(Mesh mesh, const FeaturePointPositions& points, const HumanFace& human) {
  GenericHead head;
  head.mesh = std::move(mesh);
  head.human = human;
  std::array<std::uint32_t, kFeaturePointCount> vertex{};
  for (std::size_t p = 0; p < kFeaturePointCount; ++p)
    vertex[p] = nearestVertex(head.mesh, points.row(static_cast<Eigen::Index>(p)));
  bendToProportions(human, points, head.mesh);
  std::vector<std::uint32_t> same_as(head.mesh.vertexCount());
  for (std::uint32_t v = 0; v < same_as.size(); ++v) same_as[v] = v;
  const Skin skin = prepareSkin(head.mesh, std::move(same_as));
  head.skin.resize(head.mesh.vertexCount());
  for (std::size_t v = 0; v < head.skin.size(); ++v) head.skin[v] = skin.component[v] == skin.component[vertex[0]];
  cutOutFace(head, vertex);
  passThroughPoints(head);
  return head;
}

}  // namespace

GenericHead makeGenericHead(const HumanFace& human) {
  Mesh mesh = parseObj(std::string_view(kGenericHeadObj, std::strlen(kGenericHeadObj)), "volto_head.obj");
  const FeaturePointChoices choices = parseFeaturePoints(kGenericHeadPoints, "volto_head.points.json");
  FeaturePointPositions points;
  for (std::size_t p = 0; p < kFeaturePointCount; ++p) {
    const FeaturePointChoice& choice = choices.at(p);
    if (const auto* vertex = std::get_if<std::uint32_t>(&choice))
      points.row(static_cast<Eigen::Index>(p)) = mesh.positions.row(*vertex);
    else
      points.row(static_cast<Eigen::Index>(p)) = std::get<Eigen::Vector3d>(choice).transpose();
  }
  return bentHead(std::move(mesh), points, human);
}

const GenericHead& genericHead() {
  static const GenericHead head = makeGenericHead(humanFace());
  return head;
}

}  // namespace volto::rig
