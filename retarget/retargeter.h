// From the mask to one character: FAPU scaling, weights of its blendshapes, deformed mesh. Pure mathematics,
// thread-bound: one Retargeter per thread; it borrows nothing after construction.
#pragma once

#include <memory>

#include "frames/avatar_frame.h"
#include "frames/mask_frame.h"
#include "rig/rig.h"

namespace volto::retarget {

struct RetargetOptions {
  bool mesh = true;     // compute the deformed vertices
  bool weights = true;  // compute the blendshape weights
};

class Retargeter {
 public:
  explicit Retargeter(const rig::Rig& rig, const RetargetOptions& options = {});
  ~Retargeter();
  Retargeter(Retargeter&&) noexcept;
  Retargeter& operator=(Retargeter&&) noexcept;

  std::size_t vertexCount() const;
  std::size_t blendshapeCount() const;

  // Same input, same output to the bit, apart from the warm start: weights carry over from the frame before. reset()
  // forgets it. Allocates nothing once `out` has been through it.
  void push(const MaskFrame& in, AvatarFrame& out);
  void reset();
  // Whether the frames to come carry the deformed vertices: RetargetOptions::mesh, changed.
  void setMesh(bool mesh);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace volto::retarget
