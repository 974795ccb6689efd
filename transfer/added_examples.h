// Examples that are made to be added to another one: mouthClose of most sets brings the lips of an open jaw together,
// and by itself pushes them through each other. What matters of such a shape is the sum.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "rig/contacts.h"
#include "rig/mesh.h"

namespace volto::transfer {

// Per example the index of the one that it is made to be added to, or -1. Told by the lips and lids alone, not by
// names: an example that by itself lets them pass each other by more than 0.15 eye separations (presses and rolls of
// lips stay below 0.1), while with the other one they pass by less than 0.4 of that, and are in the mean less than 0.4
// as far from how they are at rest. Where several would do, the one that brings them nearest to that. `examples`: #V by
// 3, of the mesh that `contacts` belong to. Reentrant.
std::vector<std::int32_t> addedTo(const rig::Contacts& contacts, double eye_separation,
                                  const rig::VertexPositions& neutral, std::span<const rig::VertexPositions> examples);

// neutral + (a - neutral) + (b - neutral)
rig::VertexPositions together(const rig::VertexPositions& neutral, const rig::VertexPositions& a,
                              const rig::VertexPositions& b);

}  // namespace volto::transfer
