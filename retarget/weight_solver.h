// Weights of a character's blendshapes from the motion of its mask: bounded least squares, solved anew every frame.
//
//   minimise over 0 <= w <= 1:   sum_p c_p |d_p - f_p(w)|^2  +  sum_k r_k (w_k - prior_k)^2  +  2 s sum_k w_k
//                                +  t sum_k (w_k - before_k)^2  +  q sum_pairs (w_left - w_right)^2
//   f_p(w) = sum_k w_k b_kp + sum_combinations b_p product of its parents' w,     and  w_mouthClose <= w_jawOpen
//
// d_p displacement of point p, b_kp that of shape k at full weight, both as a fraction of the eye separation; c_p
// confidence of the point. r keeps collinear shapes (smile, dimple, stretch) from fighting and pulls towards what the
// tracker's own fit or the recording says of the shape. For shapes of which nobody has said anything there are three
// more: s, the lasso's, prefers few shapes to many that come to the same; t keeps what the mask hardly shows as it was
// a frame ago, and leaves what it shows clearly alone; q lets the two sides of a pair differ only where the mask says
// so. Without combinations the problem is strictly convex: there is one answer, and where the search starts cannot
// change it.
//
// Method: block principal pivoting, started with the weights at 0 and 1 that were there in the frame before. The others
// are solved for exactly (Cholesky in single precision, gradient in double; the factor of the frame before serves as
// long as it is that of the same weights); then all that are in the wrong place change it, until none is. Combinations:
// Gauss-Newton around the last answer.
// mouthClose: where it would exceed jawOpen, the two are one variable; for a convex problem with one such condition
// that is exact.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "frames/mask_frame.h"
#include "retarget/deformer.h"
#include "retarget/shape_relations.h"
#include "rig/rig.h"

namespace volto::retarget {

struct WeightSolverOptions {
  // Affects the result. r_k of a shape that has a prior, and of one that has none (which is pulled to zero). A motion
  // of 2 % of the eye separation of 25 points together weighs 0.01.
  double prior_pull = 0.01;
  double zero_pull = 0.0005;
  // s, t (per frame) and q above; for shapes without a prior.
  double sparsity = 0.0005;
  double temporal_pull = 0.0005;
  double pair_pull = 0.0002;

  // Affects speed. A weight may be off by about this much, and the most rounds of descent before the answer is taken as
  // it is.
  double tolerance = 3e-5;
  int max_rounds = 50;
};

// Thread-bound: holds the answer of the frame before. Allocates in the constructor alone.
class WeightSolver {
 public:
  // `eye_separation`: ES0 of the character, mesh unit. Throws std::invalid_argument when it is not positive or a shape
  // is not finite.
  WeightSolver(std::span<const rig::Blendshape> shapes, double eye_separation, const WeightSolverOptions& options = {},
               std::span<const rig::Combination> combinations = {});
  // The rig's shapes, with what its combinations say of them.
  explicit WeightSolver(const rig::Rig& rig, const WeightSolverOptions& options = {});

  std::size_t shapeCount() const { return shapes_.size(); }

  // weights, observed: one per shape of the character, in its order. Weights are in 0..1 and finite whatever comes in.
  //  - A shape that is one of ARKit's, by its own name or that of a set which Volto knows (rig/shape_set.h), takes in.arkit_weights as its prior where in.arkit_observed says so. Where it does
  //  not, the shape is not
  //    observed and its weight 0; unless in.arkit_observed is empty altogether (nobody has fitted anything): then the
  //    mask decides alone.
  //  - A combination's weight is the product of its parents', and observed where they all are.
  //  - A shape that does not move the mask takes its prior where there is one; else it is not observed and its weight
  //  0.
  // `displacement`: mesh unit, mesh frame; a number that is not finite counts as no displacement.
  void solve(const MeshMaskDisplacement& displacement, const MaskFrame& in, std::span<float> weights,
             std::span<std::uint8_t> observed);

  // Forgets the frame before.
  void reset();

  // Rounds (solutions for the free weights, sweeps of descent) that the last solve() took; for tests and benchmarks.
  int lastRounds() const { return last_rounds_; }

 private:
  struct Shape {
    std::int32_t arkit = -1;  // index of the ARKit shape that it is
    bool moves_mask = true;
    bool driven = false;  // a combination
  };
  // Shape `shape` moves point `point`: as a fraction of the eye separation. Listed by point.
  struct Move {
    std::uint16_t shape;
    std::array<double, 3> by;
  };
  // What a shape is to this frame. tied: mouthClose, while it is what jawOpen is.
  enum class Role : std::uint8_t { solved, fixed, tied };
  enum class Place : std::uint8_t { zero, free, one };

  void readShapes(std::span<const rig::Blendshape> shapes);
  bool updateConfidence(const std::array<float, kFeaturePointCount>& confidence);
  void rebuildGram();
  bool assignRoles(const MaskFrame& in, std::span<std::uint8_t> observed);
  void projectDisplacement(const MeshMaskDisplacement& displacement);
  void buildSystem();
  void buildRightSide();
  void solveWithCombinations();
  void untie();
  bool tiesHold();
  void computeGradient();
  void minimise();
  bool minimiseFree();
  Place betterPlace(std::size_t k) const;
  double sweep();
  void moveTo(std::size_t k, double w);  // the gradient follows
  // Of a shape that is tied too.
  double weightOf(std::size_t k) const { return role_[k] == Role::tied ? w_[*relations_.jaw_open] : w_[k]; }

  std::vector<Shape> shapes_;
  ShapeRelations relations_;
  std::vector<Move> moves_by_point_;
  std::array<std::uint32_t, kFeaturePointCount + 1> point_start_{};
  std::vector<float> basis_;  // blocks of kBlock shapes; in each, for every coordinate of the mask, the block's shapes
  std::vector<float> projected_;
  double per_eye_separation_;
  WeightSolverOptions options_;

  std::array<std::uint8_t, kFeaturePointCount> confidence_{};  // quarters: the Gram matrix is rebuilt when one changes
  std::size_t stride_;                                         // of gram_, doubles
  std::vector<double> gram_;                                   // n by stride: B' C B, without the pulls
  // What is minimised is w' hessian w / 2 - right_side' w: all pulls, ties and tangents of combinations are in it.
  std::vector<double> hessian_;
  bool system_stale_ = true, factor_stale_ = true;
  std::vector<double> slope_;         // per parent of a driven shape: product of the others
  std::vector<double> pull_, prior_;  // n
  std::vector<std::uint8_t> has_prior_;
  std::vector<double> per_curvature_;  // n: 1 / diagonal of the Hessian
  std::vector<Role> role_;
  std::vector<Place> place_;  // carried over from frame to frame
  bool tie_ = false, has_before_ = false;
  std::int64_t before_ns_ = 0;
  std::vector<double> before_;  // the answer of the frame before
  std::vector<double> mask_side_, right_side_, gradient_, w_;
  std::vector<double> tangent_at_;
  std::vector<float> cholesky_, inverse_diagonal_, step_;
  std::vector<std::uint32_t> free_, factored_, wrong_;
  int last_rounds_ = 0;
};

}  // namespace volto::retarget
