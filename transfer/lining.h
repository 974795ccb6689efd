// The inside of the cheeks and lips stays behind the skin in front of it: a mouth's lining lies a few millimetres
// behind the groove of the chin, and lips that push forward draw that groove back through it.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "rig/rig.h"

namespace volto::transfer {

// Const calls from several threads are fine. Borrows nothing.
class Lining {
 public:
  // `inside`: one per vertex, true for the lining. `skin`: triangles in front of it. What lies further than a fifth of
  // the eye separation behind the skin, or not behind skin that faces forward, is left alone.
  Lining(const rig::Rig& rig, const std::vector<bool>& inside, std::vector<std::array<std::uint32_t, 3>> skin);

  // Moves lining that came through the skin back behind it, to half of its distance at rest.
  void keepBehind(rig::VertexPositions& positions) const;

  std::size_t size() const { return vertices_.size(); }

 private:
  struct Vertex {
    std::uint32_t vertex = 0;
    std::array<std::uint32_t, 3> skin{};
    std::array<double, 3> weight{};
    double depth = 0;  // at rest, > 0
    double reach = 0;  // > 0: further aside than this, and less and less up to twice as far, it is no longer behind it
    double side = 1;   // of the triangle's normal: 1 when it looks out of the face
  };
  std::vector<Vertex> vertices_;
};

}  // namespace volto::transfer
