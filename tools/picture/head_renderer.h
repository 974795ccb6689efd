// Pictures of a head: a software renderer that runs anywhere and gives the same bytes every time.
#pragma once

#include <array>
#include <memory>
#include <span>
#include <vector>

#include "rig/mesh.h"
#include "tools/picture/camera.h"
#include "tools/picture/look.h"
#include "tools/picture/picture.h"

namespace volto::picture {

struct Rendered {
  Picture picture;
  Camera camera;             // for drawing over it (mask_overlay.h)
  std::vector<float> depth;  // per pixel, from the viewer, mesh unit; infinite where nothing is
};

// Draws one mesh many times, deformed. Keeps its buffers, so one thread at a time. The camera is fitted to the neutral
// mesh once per view, so a sequence of frames does not jump about.
class HeadRenderer {
 public:
  // Copies what it needs. Throws std::invalid_argument for a mesh without polygons, an index out of range, or a look
  // that does not fit.
  explicit HeadRenderer(const rig::Mesh& mesh);
  HeadRenderer(const rig::Mesh& mesh, const Look& look);
  ~HeadRenderer();
  HeadRenderer(HeadRenderer&&) noexcept;
  HeadRenderer& operator=(HeadRenderer&&) noexcept;

  // Points that the camera is fitted to instead of all vertices, mesh frame: a part of the head, for a closer picture.
  void focusOn(std::span<const Vec3> points);

  // `positions`: one per vertex, mesh frame, head motion not applied. Triangles with a vertex that is not finite are
  // left out. Throws std::invalid_argument for another number of vertices or when nothing finite is there to draw.
  Rendered render(const rig::VertexPositions& positions, const ViewOptions& view = {});
  Rendered render(std::span<const std::array<float, 3>> positions, const ViewOptions& view = {});
  // At neutral.
  Rendered render(const ViewOptions& view = {});

 private:
  struct State;
  std::unique_ptr<State> state_;
};

// One picture of a mesh.
Picture renderMesh(const rig::Mesh& mesh, const rig::VertexPositions& positions, const ViewOptions& view = {});

}  // namespace volto::picture
