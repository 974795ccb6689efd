// Things that are no face, made from formulas, and what is done to meshes before a face is looked for on them.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include <Eigen/Core>

#include "rig/mesh.h"

namespace volto::rig::test {

// A closed surface: a cube's grid of n by n quads on each side, every point p of the unit sphere moved to shape(p).
Mesh shapedSphere(int n, const std::function<Eigen::Vector3d(const Eigen::Vector3d&)>& shape);

Mesh sphere();
Mesh cube();
Mesh cylinder();
Mesh flatPlane();
Mesh torus();
// A potato with bumps that are the same left and right.
Mesh symmetricBumps(std::uint32_t seed);
// Torso, arms and legs of capsules, without a head, 28 units high like a person in eye separations; shoulders at y = 0.
Mesh headlessBody();
// A palm and five fingers.
Mesh hand();

// One mesh of several, in this order.
Mesh together(std::vector<Mesh> meshes);
// p -> scale * rotation * p + shift
Mesh moved(Mesh mesh, const Eigen::Matrix3d& rotation, double scale, const Eigen::Vector3d& shift);
// Each vertex up to `amount` away from where it was, evenly, the same for the same seed.
Mesh noisy(Mesh mesh, double amount, std::uint32_t seed);
// Vertices in cells of this size become one: a coarse copy.
Mesh clustered(const Mesh& mesh, double cell);
// Only polygons all of whose vertices pass.
Mesh cropped(const Mesh& mesh, const std::function<bool(std::uint32_t vertex)>& keep);

}  // namespace volto::rig::test
