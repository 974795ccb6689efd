// From blendshape weights, or from the mask's displacement and weights, to the mesh: the one way in which anything in
// Volto deforms a character. Live frames, baked files, pictures and exported morph targets all come from here.
//
//   positions = contacts( parts( neutral + operator x mask + corrections(weights) ) )
#pragma once

#include <memory>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "frames/mask_frame.h"
#include "retarget/deformer.h"
#include "rig/rig.h"

namespace volto::retarget {

// Thread-safe after construction (const functions touch only their arguments). Borrows nothing.
class FaceDeformer {
 public:
  // Throws std::invalid_argument when the rig's parts do not fit its mesh.
  explicit FaceDeformer(const rig::Rig& rig);
  ~FaceDeformer();
  FaceDeformer(FaceDeformer&&) noexcept;
  FaceDeformer& operator=(FaceDeformer&&) noexcept;

  std::size_t vertexCount() const;
  std::size_t blendshapeCount() const;

  // `mask`: of each feature point, mesh frame and unit, finite. `weights`: one per blendshape, finite, for what the
  // mask cannot say. `gaze` with confidence turns the eyeballs, else the eyeLook weights do. Writes all #V positions,
  // mesh frame, artist's order. No allocation. No motion at all gives the neutral bit for bit.
  void deform(const MeshMaskDisplacement& mask, std::span<const float> weights, const Gaze& gaze,
              std::span<Vertex> out) const;

  // The mask follows from the weights too. Weights above 1 or below 0 are taken as they are.
  void deformAtWeights(std::span<const float> weights, std::span<Vertex> out) const;

 private:
  struct State;
  std::unique_ptr<const State> state_;
};

// One pose. For a morph target of shape k: weights all zero but weights[k] = 1; its displacement is the result minus
// rig.neutral. Make a FaceDeformer once for many. Throws std::invalid_argument for another number of weights.
std::vector<Vertex> deformAtWeights(const rig::Rig& rig, std::span<const float> weights);

// The same for shapes by name; a name that the rig has not throws std::invalid_argument.
std::vector<float> weightsByName(const rig::Rig& rig, std::span<const std::pair<std::string_view, float>> shapes);

}  // namespace volto::retarget
