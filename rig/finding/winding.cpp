#include "rig/finding/winding.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "rig/finding/find_face.h"

namespace volto::rig {
namespace {

struct PolygonEdge {
  std::uint32_t low, high;
  std::uint32_t polygon;
  bool forward;  // the polygon runs from low to high
};

struct Patches {
  std::vector<std::uint32_t> patch;  // per polygon
  std::vector<bool> turned;          // per polygon: against its patch's first polygon
  std::size_t count = 0;
  std::vector<std::size_t> polygons;  // per patch
  std::vector<bool> open;             // per patch: it has a border
};

// Over edges of exactly two polygons: neighbours must run along them in opposite directions.
Patches orientablePatches(const Mesh& mesh) {
  std::vector<PolygonEdge> edges;
  edges.reserve(mesh.corner_vertices.size());
  for (std::uint32_t p = 0; p < mesh.polygonCount(); ++p)
    for (std::uint32_t c = mesh.polygon_start[p]; c < mesh.polygon_start[p + 1]; ++c) {
      const std::uint32_t next = c + 1 < mesh.polygon_start[p + 1] ? c + 1 : mesh.polygon_start[p];
      const std::uint32_t a = mesh.corner_vertices[c];
      const std::uint32_t b = mesh.corner_vertices[next];
      if (a != b) edges.push_back({std::min(a, b), std::max(a, b), p, a < b});
    }
  std::sort(edges.begin(), edges.end(), [](const PolygonEdge& a, const PolygonEdge& b) {
    return std::tie(a.low, a.high, a.polygon, a.forward) < std::tie(b.low, b.high, b.polygon, b.forward);
  });
  struct Link {
    std::uint32_t polygon;
    bool turned;
  };
  std::vector<std::vector<Link>> links(mesh.polygonCount());
  std::vector<bool> at_border(mesh.polygonCount());
  for (std::size_t i = 0; i < edges.size();) {
    std::size_t end = i + 1;
    while (end < edges.size() && edges[end].low == edges[i].low && edges[end].high == edges[i].high) ++end;
    if (end == i + 2 && edges[i].polygon != edges[i + 1].polygon) {
      const bool turned = edges[i].forward == edges[i + 1].forward;
      links[edges[i].polygon].push_back({edges[i + 1].polygon, turned});
      links[edges[i + 1].polygon].push_back({edges[i].polygon, turned});
    } else {
      for (std::size_t k = i; k < end; ++k) at_border[edges[k].polygon] = true;
    }
    i = end;
  }
  constexpr std::uint32_t kNone = ~0U;
  Patches patches{
      std::vector<std::uint32_t>(mesh.polygonCount(), kNone), std::vector<bool>(mesh.polygonCount()), 0, {}, {}};
  std::vector<std::uint32_t> queue;
  for (std::uint32_t first = 0; first < mesh.polygonCount(); ++first) {
    if (patches.patch[first] != kNone) continue;
    queue.assign(1, first);
    patches.patch[first] = static_cast<std::uint32_t>(patches.count);
    for (std::size_t i = 0; i < queue.size(); ++i)
      for (const Link& link : links[queue[i]])
        if (patches.patch[link.polygon] == kNone) {
          patches.patch[link.polygon] = patches.patch[first];
          patches.turned[link.polygon] = patches.turned[queue[i]] != link.turned;
          queue.push_back(link.polygon);
        }
    ++patches.count;
    patches.polygons.push_back(queue.size());
    patches.open.push_back(std::any_of(queue.begin(), queue.end(), [&](std::uint32_t p) { return at_border[p]; }));
  }
  return patches;
}

}  // namespace

Winding findReversedPolygons(const Mesh& mesh, std::span<const SurfaceSample> samples,
                             std::span<const std::uint32_t> hidden_triangles, const FaceFrame& frame) {
  const Patches patches = orientablePatches(mesh);
  // triangulate() makes its triangles in polygon order, two fewer than corners each.
  std::vector<std::uint32_t> polygon_of;
  for (std::uint32_t p = 0; p < mesh.polygonCount(); ++p)
    for (std::uint32_t c = mesh.polygon_start[p] + 2; c < mesh.polygon_start[p + 1]; ++c) polygon_of.push_back(p);

  std::vector<double> vote(patches.count);    // positive: the patch's first polygon runs the right way
  std::vector<double> voters(patches.count);  // by how much it could be
  std::vector<double> sampled(patches.count);
  for (const std::uint32_t t : hidden_triangles) sampled[patches.patch[polygon_of[t]]] += 1;
  double rest = 0;
  double face = 0;
  for (const SurfaceSample& sample : samples) {
    const std::uint32_t polygon = polygon_of[sample.triangle];
    const std::uint32_t patch = patches.patch[polygon];
    const Eigen::Vector3d p = frame.toHead(sample.position);
    const bool on_face = std::abs(p.x()) < 0.8 && p.y() > -1.5 && p.y() < 0.8 && p.z() > -0.7 && p.z() < 0.8;
    double right = sample.seen_as_wound - sample.seen_reversed;
    double weight = std::max(sample.seen_as_wound, sample.seen_reversed);
    if (sample.two_sided) {
      // Seen from both sides alike: only on the face it is known where out is. The normal is as wound.
      right = on_face ? frame.mesh_from_head.col(2).dot(sample.normal) : 0;
      weight = std::abs(right);
    }
    sampled[patch] += 1;
    vote[patch] += patches.turned[polygon] ? -right : right;
    voters[patch] += weight;
    rest += right;
    if (on_face) face += right;
  }
  Winding winding;
  winding.face_reversed = face < 0;
  for (std::uint32_t p = 0; p < mesh.polygonCount(); ++p) {
    const std::uint32_t patch = patches.patch[p];
    // The little that is seen of a mouth's inside from below the neck says nothing about the mouth, and a card of
    // lashes or hair is seen from one side only because its back lies on the skin.
    const bool card = patches.open[patch] && patches.polygons[patch] < mesh.polygonCount() / 20;
    const bool says = !card && voters[patch] > 0.25 * sampled[patch] && std::abs(vote[patch]) > 0.4 * voters[patch];
    const bool wrong = says ? (vote[patch] < 0) != patches.turned[p] : rest < 0;
    if (wrong) winding.reversed.push_back(p);
  }
  return winding;
}

void reversePolygons(Mesh& mesh, std::span<const std::uint32_t> polygons) {
  for (const std::uint32_t p : polygons) {
    const std::uint32_t begin = mesh.polygon_start[p];
    const std::uint32_t end = mesh.polygon_start[p + 1];
    if (end - begin < 2) continue;
    std::reverse(mesh.corner_vertices.begin() + begin + 1, mesh.corner_vertices.begin() + end);
    if (mesh.corner_texcoords.size() == mesh.corner_vertices.size())
      std::reverse(mesh.corner_texcoords.begin() + begin + 1, mesh.corner_texcoords.begin() + end);
  }
}

}  // namespace volto::rig
