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
struct Skin {
  std::vector<std::uint32_t> same_as;  // rig/weld.h
  EdgeGraph graph;
  std::vector<std::uint32_t> component;                 // over the welded mesh, numbered in order of first vertices
  std::vector<std::array<std::uint32_t, 3>> triangles;  // the whole mesh, welded, degenerate ones left out
  VertexPositions normals;                              // unit, weighted by area; zero where there is none
  // Symmetric Laplace matrix, off-diagonal entries >= 0, parallel to graph.neighbour: half cotangents; polygons are cut into
  // triangles in all ways at once, up to eight corners, so that a mirror-symmetric mesh gives a mirror-symmetric matrix; never negative, so that no vertex
  // is pushed beyond its neighbours.
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
