// Points and lines drawn over a rendered head: the control mask, feature points, anything with a place on the mesh.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>

#include "rig/feature_points.h"
#include "tools/picture/head_renderer.h"

namespace volto::picture {

struct OverlayStyle {
  Colour line{120, 220, 255}, point{255, 214, 90};
  float line_px = 1.2F, point_px = 2.2F;  // thickness; radius
  bool labels = false;                    // the index, or the feature point's id, beside each point
  // How far behind the surface a point may lie and still be drawn in full, as a part of its distance from the viewer.
  // Farther behind: faintly.
  float depth_slack = 0.012F;
  float hidden_cover = 0.12F;
};

// The 136 triangles of the control mask and its 84 points. `positions`: mesh frame, before head motion, as given to
// render().
void drawMask(Rendered& rendered, const rig::FeaturePointPositions& positions, const OverlayStyle& style = {});

// Points of the mesh frame, numbered in order where labels are asked for.
void drawPoints(Rendered& rendered, std::span<const Vec3> points, const OverlayStyle& style = {});

// The mesh's own edges: every polygon's outline, where it is in front.
void drawWireframe(Rendered& rendered, const rig::Mesh& mesh, const rig::VertexPositions& positions,
                   const OverlayStyle& style = {});

}  // namespace volto::picture
