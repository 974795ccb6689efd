// How well a character stands being moved: triangles that turn over, skin inside an eyeball, lips and lids that pass
// each other, lids that do not close. Measured on the deformed mesh itself, whatever made it.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "retarget/face_deformer.h"
#include "rig/combined_expressions.h"
#include "rig/rig.h"

namespace volto::retarget {

// Of one pose. Depths are parts of the eye separation.
struct PoseHealth {
  std::string name;
  std::size_t flipped = 0;      // triangles that face away from where they faced at rest, by more than a right angle
  std::size_t flipped_skin = 0;  // of these, those of the skin itself: no lash, no wet edge of a lid, no gum
  std::size_t degenerate = 0;   // triangles left with less than a thousandth of their area
  double eyeball_depth_es = 0;  // of the deepest skin vertex in an eyeball, beyond what it was at rest
  double lids_depth_es = 0;     // of the deepest vertex of one lid in the other, beyond rest
  double lips_depth_es = 0;
};

struct ExpressionHealth {
  std::vector<PoseHealth> shapes;        // each blendshape at 1
  std::vector<PoseHealth> combinations;  // rig::combinedExpressions()
  std::size_t triangles = 0;             // of the mesh
  double blink_gap_es = 0;               // what eyeBlinkLeft and eyeBlinkRight leave open at the widest column
  double symmetry_es = 0;  // left shapes against right ones' mirror image, at the feature points' vertices
  double border_es = 0;    // displacement of vertices that the operator does not move, rigid parts aside

  std::size_t flipped() const;  // all shapes and combinations together
  std::size_t flippedSkin() const;
  std::size_t degenerate() const;
  PoseHealth worst() const;  // the largest of each number; name: of the pose with most flips
};

// Measures poses of one character. Const functions may run at once; borrows nothing.
class HealthMeasure {
 public:
  explicit HealthMeasure(const rig::Rig& rig);
  ~HealthMeasure();

  // Of positions that came from anywhere, #V.
  PoseHealth measure(const std::string& name, std::span<const Vertex> positions) const;
  // Of weights, one per blendshape.
  PoseHealth measureWeights(const std::string& name, std::span<const float> weights) const;
  ExpressionHealth measureAll();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

// All shapes and the combined expressions whose shapes the rig has. About a millisecond a pose.
ExpressionHealth measureExpressions(const rig::Rig& rig);

}  // namespace volto::retarget
