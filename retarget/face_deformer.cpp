#include "retarget/face_deformer.h"

#include <stdexcept>
#include <string>

#include "retarget/eyes.h"
#include "retarget/packed_corrections.h"
#include "rig/pose.h"
#include "rig/prepared_contacts.h"

namespace volto::retarget {

struct FaceDeformer::State {
  std::vector<Vertex> neutral;
  rig::Rig layers;  // what rig/pose.h reads, and nothing else
  Deformer deformer;
  Eyes eyes;
  PackedCorrections corrections;
  rig::PreparedContacts contacts;

  explicit State(const rig::Rig& rig)
      : neutral(rig::neutralPositions(checked(rig))),
        deformer(rig.deformation, neutral),
        eyes(rig),
        corrections(rig),
        contacts(rig.contacts, neutral) {
    layers.blendshapes = rig.blendshapes;
    for (rig::Blendshape& shape : layers.blendshapes) shape.correction = {};  // packed above
    layers.part_motions = rig.part_motions;
  }

  static const rig::Rig& checked(const rig::Rig& rig) {
    rig::checkPoseData(rig);
    return rig;
  }

  void checkWeights(std::size_t count) const {
    if (count != layers.blendshapes.size())
      throw std::invalid_argument(std::to_string(count) + " weights for " + std::to_string(layers.blendshapes.size()) +
                                  " blendshapes");
  }
};

FaceDeformer::FaceDeformer(const rig::Rig& rig) : state_(std::make_unique<State>(rig)) {}
FaceDeformer::~FaceDeformer() = default;
FaceDeformer::FaceDeformer(FaceDeformer&&) noexcept = default;
FaceDeformer& FaceDeformer::operator=(FaceDeformer&&) noexcept = default;

std::size_t FaceDeformer::vertexCount() const { return state_->neutral.size(); }
std::size_t FaceDeformer::blendshapeCount() const { return state_->layers.blendshapes.size(); }

void FaceDeformer::deform(const MeshMaskDisplacement& mask, std::span<const float> weights, const Gaze& gaze,
                          std::span<Vertex> out) const {
  const State& s = *state_;
  s.checkWeights(weights.size());
  s.deformer.deform(mask, out);
  const bool gaze_known = gaze.confidence > 0.0F;
  rig::putPartsBack(s.layers, s.neutral, out);
  s.corrections.addTo(weights, out);
  rig::turnParts(s.layers, weights, !gaze_known, out);
  s.contacts.resolve(out);
  if (gaze_known) s.eyes.turn(gaze, out);
}

void FaceDeformer::deformAtWeights(std::span<const float> weights, std::span<Vertex> out) const {
  state_->checkWeights(weights.size());
  MeshMaskDisplacement mask{};
  for (std::size_t k = 0; k < weights.size(); ++k) {
    const rig::Blendshape& shape = state_->layers.blendshapes[k];
    if (weights[k] == 0.0F) continue;
    for (std::size_t p = 0; p < mask.size(); ++p) {
      for (std::size_t axis = 0; axis < 3; ++axis) mask[p][axis] += weights[k] * shape.mask_displacement[p][axis];
    }
  }
  deform(mask, weights, Gaze{}, out);
}

std::vector<Vertex> deformAtWeights(const rig::Rig& rig, std::span<const float> weights) {
  const FaceDeformer deformer(rig);
  std::vector<Vertex> out(deformer.vertexCount());
  deformer.deformAtWeights(weights, out);
  return out;
}

std::vector<float> weightsByName(const rig::Rig& rig, std::span<const std::pair<std::string_view, float>> shapes) {
  std::vector<float> out(rig.blendshapes.size(), 0.0F);
  for (const auto& [name, weight] : shapes) {
    bool found = false;
    for (std::size_t k = 0; k < out.size(); ++k) {
      if (rig.blendshapes[k].name != name) continue;
      out[k] = weight;
      found = true;
    }
    if (!found) throw std::invalid_argument("the rig has no blendshape " + std::string(name));
  }
  return out;
}

}  // namespace volto::retarget
