#include "retarget/retargeter.h"

#include <vector>

#include "retarget/deformer.h"
#include "retarget/eyes.h"
#include "retarget/mask_scale.h"
#include "retarget/weight_solver.h"

namespace volto::retarget {
namespace {

std::vector<Vertex> singlePrecision(const rig::VertexPositions& positions) {
  std::vector<Vertex> out(static_cast<std::size_t>(positions.rows()));
  for (std::size_t v = 0; v < out.size(); ++v) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      out[v][axis] = static_cast<float>(positions(static_cast<Eigen::Index>(v), static_cast<Eigen::Index>(axis)));
    }
  }
  return out;
}

}  // namespace

struct Retargeter::State {
  RetargetOptions options;
  MaskScale scale;
  Deformer deformer;
  Eyes eyes;
  WeightSolver solver;
  MeshMaskDisplacement displacement{};

  State(const rig::Rig& rig, const RetargetOptions& wanted)
      : options(wanted),
        scale(rig),
        deformer(rig.deformation, singlePrecision(rig.neutral.positions)),
        eyes(rig),
        solver(rig.blendshapes, rig.fapu.fapu.eye_separation) {}
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
  if (s.options.weights) {
    out.weights.resize(s.solver.shapeCount());
    out.observed.resize(s.solver.shapeCount());
    s.solver.solve(s.displacement, in, out.weights, out.observed);
  } else {
    out.weights.clear();
    out.observed.clear();
  }
  if (s.options.mesh) {
    out.vertices.resize(s.deformer.vertexCount());
    s.deformer.deform(s.displacement, out.vertices);
    s.eyes.turn(in.gaze, out.vertices);
  } else {
    out.vertices.clear();
  }
}

void Retargeter::reset() { state_->solver.reset(); }

}  // namespace volto::retarget
