// Weights of a character's blendshapes from the motion of its mask: bounded least squares, solved anew every frame.
//
//   minimise over 0 <= w <= 1:   sum_p c_p |d_p - sum_k w_k b_kp|^2  +  sum_k r_k (w_k - prior_k)^2
//
// d_p displacement of point p, b_kp that of shape k at full weight, both as a fraction of the eye separation; c_p
// confidence of the point. The second term keeps collinear shapes (smile, dimple, stretch) from fighting and pulls
// towards what the tracker's own fit or the recording says of the shape. Strictly convex: there is one answer, and
// where the search starts cannot change it.
//
// Method: coordinate descent on the Gram matrix, started at the answer of the frame before, finds which weights lie at
// a bound; a Newton step on the others (Cholesky) is then exact. Two to four rounds in practice.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "frames/mask_frame.h"
#include "retarget/deformer.h"
#include "rig/rig.h"

namespace volto::retarget {

struct WeightSolverOptions {
  // Affects the result. r_k of a shape that has a prior, and of one that has none (which is pulled to zero). A motion
  // of 2 % of the eye separation of 25 points together weighs 0.01.
  double prior_pull = 0.01;
  double zero_pull = 0.002;

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
  WeightSolver(std::span<const rig::Blendshape> shapes, double eye_separation, const WeightSolverOptions& options = {});

  std::size_t shapeCount() const { return shapes_.size(); }

  // weights, observed: one per shape of the character, in its order. Weights are in 0..1 and finite whatever comes in.
  //  - A shape with an ARKit name takes in.arkit_weights as its prior where in.arkit_observed says so. Where it does
  //  not, the shape is not
  //    observed and its weight 0; unless in.arkit_observed is empty altogether (nobody has fitted anything): then the
  //    mask decides alone.
  //  - A shape that does not move the mask takes its prior where there is one; else it is not observed and its weight
  //  0.
  // `displacement`: mesh unit, mesh frame; a number that is not finite counts as no displacement.
  void solve(const MeshMaskDisplacement& displacement, const MaskFrame& in, std::span<float> weights,
             std::span<std::uint8_t> observed);

  // Forgets the frame before.
  void reset();

  // Rounds that the last solve() took; for tests and benchmarks.
  int lastRounds() const { return last_rounds_; }

 private:
  struct Shape {
    std::int32_t arkit = -1;  // index of its ARKit name
    bool moves_mask = true;
    std::uint32_t first_move = 0, move_count = 0;  // into moves_
  };
  // Shape `shape` moves point `point`: as a fraction of the eye separation. Listed by shape, and once more by point.
  struct Move {
    std::uint16_t point, shape;
    std::array<double, 3> by;
  };
  // What a shape is to this frame.
  enum class Role : std::uint8_t { solved, fixed };

  bool updateConfidence(const std::array<float, kFeaturePointCount>& confidence);
  void rebuildGram();
  void assignRoles(const MaskFrame& in, std::span<std::uint8_t> observed);
  void buildRightSide(const MeshMaskDisplacement& displacement);
  void computeGradient();
  void minimise();
  double sweep(std::size_t& changes_of_bound);
  bool newtonStep();
  double objective() const;
  void shift(std::size_t k, double by);  // w_k += by, gradient follows

  std::vector<Shape> shapes_;
  std::vector<Move> moves_;           // by shape
  std::vector<Move> moves_by_point_;  // by point
  std::array<std::uint32_t, kFeaturePointCount + 1> point_start_{};
  double per_eye_separation_;
  WeightSolverOptions options_;

  std::array<std::uint8_t, kFeaturePointCount> confidence_{};  // quarters: the Gram matrix is rebuilt when one changes
  std::size_t stride_;                                         // of gram_, doubles
  std::vector<double> gram_;                                   // n by stride: B' C B, without the pulls
  std::vector<double> pull_, prior_;                           // n
  std::vector<double> per_curvature_;                          // n: 1 / (diagonal of the Gram matrix + pull)
  std::vector<Role> role_;
  std::vector<double> right_side_, gradient_, w_;
  std::vector<double> cholesky_, step_, start_;
  std::vector<std::uint32_t> free_;
  int last_rounds_ = 0;
};

}  // namespace volto::retarget
