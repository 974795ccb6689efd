#include "retarget/retargeter.h"

#include <vector>

#include "retarget/face_deformer.h"
#include "retarget/mask_scale.h"
#include "retarget/weight_solver.h"

namespace volto::retarget {
struct Retargeter::State {
  RetargetOptions options;
  MaskScale scale;
  FaceDeformer deformer;
  WeightSolver solver;
  MeshMaskDisplacement displacement{};
  std::vector<float> weights;
  std::vector<std::uint8_t> observed;

  State(const rig::Rig& rig, const RetargetOptions& wanted)
      : options(wanted),
        scale(rig),
        deformer(rig),
        solver(rig),
        weights(solver.shapeCount()),
        observed(solver.shapeCount()) {}
};

Retargeter::Retargeter(const rig::Rig& rig, const RetargetOptions& options)
    : state_(std::make_unique<State>(rig, options)) {}
Retargeter::~Retargeter() = default;
Retargeter::Retargeter(Retargeter&&) noexcept = default;
Retargeter& Retargeter::operator=(Retargeter&&) noexcept = default;

std::size_t Retargeter::vertexCount() const { return state_->deformer.vertexCount(); }
std::size_t Retargeter::blendshapeCount() const { return state_->solver.shapeCount(); }

void Retargeter::push(const MaskFrame& in, AvatarFrame& out) {
  State& s = *state_;
  out.t_capture_ns = in.t_capture_ns;
  out.capture_seq = in.capture_seq;
  out.state = in.state;
  out.confidence = in.confidence;
  out.head = in.head;
  out.gaze = in.gaze;
  s.scale.apply(in.displacement_fapu, s.displacement);
  // The mesh needs the weights too: what 84 points cannot say hangs on them.
  s.solver.solve(s.displacement, in, s.weights, s.observed);
  if (s.options.weights) {
    out.weights.assign(s.weights.begin(), s.weights.end());
    out.observed.assign(s.observed.begin(), s.observed.end());
  } else {
    out.weights.clear();
    out.observed.clear();
  }
  if (s.options.mesh) {
    out.vertices.resize(s.deformer.vertexCount());
    s.deformer.deform(s.displacement, s.weights, in.gaze, out.vertices);
  } else {
    out.vertices.clear();
  }
}

void Retargeter::reset() { state_->solver.reset(); }

void Retargeter::setMesh(bool mesh) { state_->options.mesh = mesh; }

}  // namespace volto::retarget
