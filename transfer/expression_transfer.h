// One rigged character's expressions on another's face, by either of two methods. What the target's contacts know is
// kept: lids run along the eyeball, lips and lids do not pass each other (rig/contacts.h).
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "rig/rig.h"
#include "transfer/deformation_transfer.h"

namespace volto::transfer {

enum class Method {
  // By the control mask (transfer/mask_transfer.h). Smooth, and as fine as the mask: it cannot carry a wrinkle between
  // its
  // points. Needs nothing to correspond but the feature points: heads of any kind.
  mask,
  // By deformation gradients (transfer/deformation_transfer.h). Carries all detail of the examples, where a place of
  // the
  // source's face corresponds to each of the target's; the mask elsewhere. For faces that are built alike.
  deformation,
};

struct ExpressionTransferOptions {
  Method method = Method::deformation;
  int threads = 0;  // 0: every core
};

class ExpressionTransfer {
 public:
  // Borrows `source` and `target`. Throws rig::InputError when no place of the two faces corresponds.
  ExpressionTransfer(const rig::Rig& source, const rig::Rig& target, const ExpressionTransferOptions& options = {});
  ~ExpressionTransfer();
  ExpressionTransfer(const ExpressionTransfer&) = delete;
  ExpressionTransfer& operator=(const ExpressionTransfer&) = delete;

  // One per example, #V by 3 of the target, its order, frame and unit. `examples`: #V by 3 of the source. An example
  // equal to the source's neutral gives the target's, to rounding. One that is made to be added to another of them
  // (transfer/added_examples.h) is carried with it and comes back as the difference. The same bits whatever the number of threads. Throws
  // std::invalid_argument for an example of another size.
  std::vector<rig::VertexPositions> transfer(std::span<const rig::VertexPositions> examples) const;

  // For people.
  bool sameMesh() const;
  std::size_t maskPoints() const;             // of the target
  std::size_t correspondingVertices() const;  // of the target; method deformation alone

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace volto::transfer
