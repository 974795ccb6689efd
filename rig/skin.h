// The surface that carries the feature points, ready for geometry: seams welded, edges, areas, normals.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "rig/geodesic.h"
#include "rig/mesh.h"

namespace volto::rig {

// Arrays are #V of the mesh; only a vertex that stands for itself (same_as[v] == v) has neighbours, a normal and an
// area.
// Half the cotangent of each corner's angle: the weight of the edge opposite to it, from this triangle.
struct CotangentTriangle {
  std::array<std::uint32_t, 3> vertices;  // that stand for others (Skin::same_as)
  std::array<double, 3> weight;
};

struct Skin {
  std::vector<std::uint32_t> same_as;  // rig/weld.h
  EdgeGraph graph;
  std::vector<std::uint32_t> component;                 // over the welded mesh, numbered in order of first vertices
  std::vector<std::array<std::uint32_t, 3>> triangles;  // the whole mesh, welded, degenerate ones left out
  VertexPositions normals;                              // unit, weighted by area; zero where there is none
  // Of all the ways to cut a polygon in triangles, sharing its weight, up to eight corners, so that a mirror-symmetric
  // mesh gives a mirror-symmetric matrix.
  std::vector<CotangentTriangle> cotangents;
  // Their sum, the symmetric Laplace matrix of linear elements, off-diagonal entries, parallel to graph.neighbour.
  // Entries across long triangles are negative: without them the matrix would be one of the mesh and not of the
  // surface.
  std::vector<double> laplacian;
  std::vector<double> area;  // a third of the triangles around

  bool stands(std::uint32_t v) const { return same_as[v] == v; }
};

// `polygons`: of the same vertices, what joins them (rig/t_vertices.h); the mesh itself where nothing is odd.
Skin prepareSkin(const Mesh& mesh, const Mesh& polygons, std::vector<std::uint32_t> same_as);
inline Skin prepareSkin(const Mesh& mesh, std::vector<std::uint32_t> same_as) {
  return prepareSkin(mesh, mesh, std::move(same_as));
}

}  // namespace volto::rig
