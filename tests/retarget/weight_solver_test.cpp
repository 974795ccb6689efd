#include "retarget/weight_solver.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "frames/arkit_blendshapes.h"
#include "tests/retarget/synthetic_rig.h"

namespace volto::retarget {
namespace {

using test::syntheticExpression;
using test::syntheticRig;

// A character and its solver; the mask is made of known weights, plus something that no weights explain.
struct Character {
  rig::Rig rig;
  WeightSolverOptions options;
  WeightSolver solver;
  std::vector<float> weights;
  std::vector<std::uint8_t> observed;
  MaskFrame frame;
  MeshMaskDisplacement displacement{};

  explicit Character(rig::Rig made = syntheticRig({.skin_side = 4}),
                     WeightSolverOptions chosen = {.temporal_pull = 0.0})
      : rig(std::move(made)),
        options(chosen),
        solver(rig, chosen),
        weights(solver.shapeCount()),
        observed(solver.shapeCount()) {
    frame.point_confidence.fill(1.0F);
  }

  void show(const std::vector<double>& shapes, double noise = 0.0, std::uint32_t seed = 1) {
    const MaskDisplacements other = syntheticExpression(seed, 1.0F);
    for (std::size_t p = 0; p < kFeaturePointCount; ++p) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        double sum = noise * rig.fapu.fapu.eye_separation * static_cast<double>(other[p][axis]);
        for (std::size_t k = 0; k < shapes.size(); ++k) {
          sum += shapes[k] * static_cast<double>(rig.blendshapes[k].mask_displacement[p][axis]);
        }
        displacement[p][axis] = static_cast<float>(sum);
      }
    }
  }

  void solve() { solver.solve(displacement, frame, weights, observed); }

  // Which shapes mirror each other, told apart from the library.
  std::vector<std::pair<Eigen::Index, Eigen::Index>> pairs(const Eigen::MatrixXd& basis) const {
    std::vector<std::pair<Eigen::Index, Eigen::Index>> out;
    for (std::size_t k = 0; k < std::min(kArkitBlendshapeCount, rig.blendshapes.size()); ++k) {
      const std::size_t other = arkitMirrorIndex(k);
      if (other <= k || other >= rig.blendshapes.size() || kArkitBlendshapeNames[k].starts_with("eyeLook")) continue;
      const Eigen::VectorXd a = basis.col(static_cast<Eigen::Index>(k)),
                            b = basis.col(static_cast<Eigen::Index>(other));
      if (a.dot(b) >= -0.3 * a.norm() * b.norm())
        out.emplace_back(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(other));
    }
    return out;
  }

  // Onto the weights that are allowed: 0 to `upper`, mouthClose at most jawOpen.
  void allow(Eigen::VectorXd& w, const Eigen::VectorXd& upper) const {
    const auto close = static_cast<Eigen::Index>(*arkitBlendshapeIndex("mouthClose"));
    const auto jaw = static_cast<Eigen::Index>(*arkitBlendshapeIndex("jawOpen"));
    if (w.size() > std::max(close, jaw) && w[close] > w[jaw]) w[close] = w[jaw] = 0.5 * (w[close] + w[jaw]);
    w = w.cwiseMax(0.0).cwiseMin(upper);
  }

  // The same problem by accelerated projected gradient, in double precision, until the conditions of an optimum hold to
  // 1e-9.
  Eigen::VectorXd exact(const Eigen::VectorXd& prior, const Eigen::VectorXd& pull, const Eigen::VectorXd& upper) const {
    const auto n = static_cast<Eigen::Index>(rig.blendshapes.size());
    Eigen::MatrixXd basis(3 * kFeaturePointCount, n);
    Eigen::VectorXd motion(3 * kFeaturePointCount);
    for (Eigen::Index p = 0; p < static_cast<Eigen::Index>(kFeaturePointCount); ++p) {
      const double c = std::sqrt(static_cast<double>(frame.point_confidence[static_cast<std::size_t>(p)])) /
                       rig.fapu.fapu.eye_separation;
      for (Eigen::Index axis = 0; axis < 3; ++axis) {
        const auto at = [&](const auto& rows) {
          return c * static_cast<double>(rows[static_cast<std::size_t>(p)][static_cast<std::size_t>(axis)]);
        };
        motion[3 * p + axis] = at(displacement);
        for (Eigen::Index k = 0; k < n; ++k) {
          basis(3 * p + axis, k) = at(rig.blendshapes[static_cast<std::size_t>(k)].mask_displacement);
        }
      }
    }
    Eigen::MatrixXd hessian = basis.transpose() * basis;
    hessian.diagonal() += pull;
    Eigen::VectorXd linear = basis.transpose() * motion + pull.cwiseProduct(prior);
    linear.array() -= options.sparsity;
    for (const auto& [a, b] : pairs(basis)) {
      hessian(a, a) += options.pair_pull;
      hessian(b, b) += options.pair_pull;
      hessian(a, b) -= options.pair_pull;
      hessian(b, a) -= options.pair_pull;
    }
    const double step = 1.0 / hessian.operatorNorm();
    Eigen::VectorXd w = Eigen::VectorXd::Zero(n), y = w;
    double t = 1.0;
    for (int i = 0; i < 100000; ++i) {
      Eigen::VectorXd next = y - step * (hessian * y - linear);
      allow(next, upper);
      if ((y - next).dot(next - w) > 0.0) {
        t = 1.0;  // overshot: restart the acceleration
        y = next;
      } else {
        const double t_next = 0.5 * (1.0 + std::sqrt(1.0 + 4.0 * t * t));
        y = next + (t - 1.0) / t_next * (next - w);
        t = t_next;
      }
      w = next;
      Eigen::VectorXd check = w - step * (hessian * w - linear);
      allow(check, upper);
      if ((check - w).lpNorm<Eigen::Infinity>() < 1e-11) return w;
    }
    ADD_FAILURE() << "the reference did not converge";
    return w;
  }
};

std::vector<double> someWeights(std::size_t count, std::uint32_t seed) {
  const MaskDisplacements random = syntheticExpression(seed, 1.0F);
  std::vector<double> out(count);
  for (std::size_t k = 0; k < count; ++k) {
    out[k] = std::clamp(1.6 * static_cast<double>(random[k % kFeaturePointCount][k % 3]), 0.0, 1.0);
  }
  const std::size_t close = *arkitBlendshapeIndex("mouthClose"), jaw = *arkitBlendshapeIndex("jawOpen");
  if (count > std::max(close, jaw)) out[close] = std::min(out[close], out[jaw]);
  return out;
}

constexpr std::size_t kTongueOut = 51;

TEST(WeightSolver, KnownWeightsComeBackFromTheMaskTheyMade) {
  Character face(syntheticRig({.skin_side = 4, .blendshapes = 20}),
                 {.prior_pull = 1e-7, .zero_pull = 1e-7, .sparsity = 0, .temporal_pull = 0, .pair_pull = 0});
  for (std::uint32_t seed = 0; seed < 5; ++seed) {
    const auto truth = someWeights(20, seed);
    face.show(truth);
    face.solve();
    for (std::size_t k = 0; k < truth.size(); ++k) EXPECT_NEAR(face.weights[k], truth[k], 2e-3) << k;
  }
}

TEST(WeightSolver, AgreesWithTheExactBoundedSolution) {
  Character face;
  const auto n = static_cast<Eigen::Index>(face.weights.size());
  std::vector<double> errors;
  for (std::uint32_t seed = 0; seed < 60; ++seed) {
    face.show(someWeights(52, seed / 4), 0.01 * (seed % 4),
              seed);  // up to 4 % of the eye separation that no shape explains
    face.solve();
    Eigen::VectorXd upper = Eigen::VectorXd::Ones(n);
    upper[kTongueOut] = 0.0;
    const Eigen::VectorXd exact =
        face.exact(Eigen::VectorXd::Zero(n), Eigen::VectorXd::Constant(n, face.options.zero_pull), upper);
    double worst = 0.0;
    for (Eigen::Index k = 0; k < n; ++k)
      worst = std::max(worst, std::abs(face.weights[static_cast<std::size_t>(k)] - exact[k]));
    errors.push_back(worst);
  }
  EXPECT_LT(*std::max_element(errors.begin(), errors.end()), 1e-3);
}

TEST(WeightSolver, LessCertainPointsCountLess) {
  Character face;
  const auto n = static_cast<Eigen::Index>(face.weights.size());
  face.show(someWeights(52, 7), 0.05, 3);
  for (std::size_t p = 0; p < kFeaturePointCount; p += 3) face.frame.point_confidence[p] = 0.25F;
  face.solve();
  Eigen::VectorXd upper = Eigen::VectorXd::Ones(n);
  upper[kTongueOut] = 0.0;
  const Eigen::VectorXd exact =
      face.exact(Eigen::VectorXd::Zero(n), Eigen::VectorXd::Constant(n, face.options.zero_pull), upper);
  for (Eigen::Index k = 0; k < n; ++k) EXPECT_NEAR(face.weights[static_cast<std::size_t>(k)], exact[k], 1e-3) << k;
  const std::vector<float> halves = face.weights;

  face.frame.point_confidence.fill(1.0F);
  face.solve();
  EXPECT_NE(face.weights, halves) << "confidence made no difference";
  const std::vector<float> certain = face.weights;
  face.frame.point_confidence.fill(0.5F);  // all alike: the same face, only less certain as a whole
  face.solve();
  for (std::size_t k = 0; k < certain.size(); ++k) EXPECT_NEAR(face.weights[k], certain[k], 2e-5);
}

TEST(WeightSolver, PriorDecidesWhatTheMaskLeavesOpen) {
  // Two shapes that move the mask alike: only the prior can tell them apart.
  rig::Rig twins = syntheticRig({.skin_side = 4});
  const std::size_t smile = *arkitBlendshapeIndex("mouthSmileLeft"), dimple = *arkitBlendshapeIndex("mouthDimpleLeft");
  twins.blendshapes[dimple].mask_displacement = twins.blendshapes[smile].mask_displacement;
  Character face(twins);
  std::vector<double> truth(52, 0.0);
  truth[smile] = 0.7;
  face.show(truth);
  face.frame.arkit_observed.set();
  face.frame.arkit_weights[smile] = 0.7F;
  face.solve();
  EXPECT_NEAR(face.weights[smile], 0.7, 1e-3);
  EXPECT_NEAR(face.weights[dimple], 0.0, 1e-3);
  face.frame.arkit_weights = {};
  face.solve();
  EXPECT_NEAR(face.weights[smile], face.weights[dimple], 1e-3);
  EXPECT_NEAR(face.weights[smile] + face.weights[dimple], 0.7, 0.1);
}

TEST(WeightSolver, ShapesThatTheMaskCannotShowTakeThePrior) {
  Character face;
  face.show(someWeights(52, 2));
  face.solve();
  EXPECT_EQ(face.weights[kTongueOut], 0.0F);
  EXPECT_EQ(face.observed[kTongueOut], 0);
  EXPECT_EQ(std::count(face.observed.begin(), face.observed.end(), 1), 51);
  face.frame.arkit_observed.set(kTongueOut);
  face.frame.arkit_weights[kTongueOut] = 0.625F;
  face.solve();
  EXPECT_EQ(face.weights[kTongueOut], 0.625F);
  EXPECT_EQ(face.observed[kTongueOut], 1);
}

TEST(WeightSolver, ShapesThatTheInputCannotShowAreZeroAndNotObserved) {
  rig::Rig rig = syntheticRig({.skin_side = 4, .blendshapes = 53});  // the 53rd has a name of its own
  Character face(rig);
  const std::size_t puff = *arkitBlendshapeIndex("cheekPuff");
  std::vector<double> truth(53, 0.0);
  truth[puff] = 1.0;
  truth[52] = 0.5;
  face.show(truth);
  face.frame.arkit_observed.set();
  face.frame.arkit_observed.reset(puff);
  face.solve();
  EXPECT_EQ(face.weights[puff], 0.0F);
  EXPECT_EQ(face.observed[puff], 0);
  EXPECT_EQ(face.observed[52], 1);
  EXPECT_GT(face.weights[52], 0.25F);
}

TEST(WeightSolver, WarmStartDoesNotChangeTheAnswer) {
  Character warm, cold;
  double worst = 0.0;
  for (std::uint32_t seed = 0; seed < 100; ++seed) {
    warm.show(someWeights(52, seed / 2), 0.02, seed);
    cold.displacement = warm.displacement;
    warm.solve();
    cold.solver.reset();
    cold.solve();
    for (std::size_t k = 0; k < warm.weights.size(); ++k) {
      worst = std::max(worst, std::abs(static_cast<double>(warm.weights[k]) - static_cast<double>(cold.weights[k])));
    }
  }
  EXPECT_LT(worst, 2e-4);
}

TEST(WeightSolver, SmallMotionTakesFewRounds) {
  Character face;
  int most = 0;
  for (int i = 0; i < 200; ++i) {
    std::vector<double> weights = someWeights(52, 3);
    for (double& w : weights) w *= 0.5 + 0.5 * std::sin(0.05 * i);
    face.show(weights, 0.01, 5);
    face.solve();
    if (i > 0) most = std::max(most, face.solver.lastRounds());
  }
  EXPECT_LE(most, 10);
}

// mask of a set with a combination, straight from the definition
MeshMaskDisplacement maskOf(const rig::Rig& rig, const std::vector<double>& weights) {
  MeshMaskDisplacement out{};
  for (std::size_t p = 0; p < kFeaturePointCount; ++p)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      double sum = 0;
      for (std::size_t k = 0; k < weights.size(); ++k)
        sum += weights[k] * static_cast<double>(rig.blendshapes[k].mask_displacement[p][axis]);
      out[p][axis] = static_cast<float>(sum);
    }
  return out;
}

TEST(WeightSolver, ACombinationIsTheProductOfItsParentsAndTheyComeBackFromTheMask) {
  rig::Rig rig = syntheticRig({.skin_side = 4, .blendshapes = 14});
  for (std::size_t k = 0; k < 14; ++k) rig.blendshapes[k].name = "shape" + std::to_string(k);
  // As large as a shape of its own: no small correction.
  rig.blendshapes[12].name = "shape2+shape5";
  rig.blendshapes[13].name = "shape1+shape5+shape7";
  rig.combinations = {
      {"shape2+shape5", rig::Combination::Rule::product, {{2, false}, {5, false}}, {}},
      {"shape1+shape5+shape7", rig::Combination::Rule::product, {{1, false}, {5, false}, {7, false}}, {}}};
  Character face(rig, {.prior_pull = 1e-7, .zero_pull = 1e-7, .sparsity = 0, .temporal_pull = 0, .pair_pull = 0});
  for (std::uint32_t seed = 0; seed < 20; ++seed) {
    std::vector<double> truth = someWeights(14, seed);
    truth[12] = truth[2] * truth[5];
    truth[13] = truth[1] * truth[5] * truth[7];
    face.displacement = maskOf(face.rig, truth);
    face.solve();
    for (std::size_t k = 0; k < truth.size(); ++k) EXPECT_NEAR(face.weights[k], truth[k], 3e-3) << seed << ": " << k;
    EXPECT_NEAR(face.weights[12], face.weights[2] * face.weights[5], 1e-6);
    EXPECT_NEAR(face.weights[13], face.weights[1] * face.weights[5] * face.weights[7], 1e-6);
  }
  EXPECT_EQ(face.observed[12], 1);
}

TEST(WeightSolver, MouthCloseNeverExceedsJawOpenAndIsThenTheBestOfThoseThatDoNot) {
  Character face;
  const std::size_t close = *arkitBlendshapeIndex("mouthClose"), jaw = *arkitBlendshapeIndex("jawOpen");
  const auto n = static_cast<Eigen::Index>(face.weights.size());
  Eigen::VectorXd upper = Eigen::VectorXd::Ones(n);
  upper[kTongueOut] = 0.0;
  const Eigen::VectorXd none = Eigen::VectorXd::Zero(n);
  const Eigen::VectorXd pull = Eigen::VectorXd::Constant(n, face.options.zero_pull);
  // In and out of the condition, so that it has to be taken back too.
  for (const auto& [c, j] : {std::pair{0.8, 0.2}, {0.5, 0.4}, {0.2, 0.9}, {1.0, 0.0}, {0.0, 0.0}, {0.9, 0.8}}) {
    std::vector<double> truth = someWeights(52, 4);
    truth[close] = c;
    truth[jaw] = j;
    face.show(truth, 0.01, 8);
    face.solve();
    EXPECT_LE(face.weights[close], face.weights[jaw]);
    const Eigen::VectorXd exact = face.exact(none, pull, upper);
    for (Eigen::Index k = 0; k < n; ++k)
      EXPECT_NEAR(face.weights[static_cast<std::size_t>(k)], exact[k], 1e-3) << c << " " << j << ": " << k;
  }
}

TEST(WeightSolver, WhatTheMaskHardlyShowsIsSmoothInTimeAndWhatItShowsIsNotLate) {
  // Shape 0 hardly moves the mask, shape 3 does.
  rig::Rig rig = syntheticRig({.skin_side = 4, .blendshapes = 6});
  for (std::size_t k = 0; k < 6; ++k) rig.blendshapes[k].name = "shape" + std::to_string(k);
  for (auto& by : rig.blendshapes[0].mask_displacement)
    for (float& x : by) x *= 0.05F;
  const auto jitterAndLag = [&](double temporal_pull) {
    WeightSolverOptions options;
    options.temporal_pull = temporal_pull;
    options.zero_pull = options.sparsity = 5e-5;
    Character face(rig, options);
    double jitter = 0, lag = 0, last = 0;
    for (int i = 0; i < 120; ++i) {
      face.frame.t_capture_ns = 16'666'667LL * i;
      const double moving = 0.5 + 0.4 * std::sin(0.2 * i);
      face.show({0.5, 0, 0, moving, 0, 0}, 0.001, static_cast<std::uint32_t>(i));
      face.solve();
      if (i > 20) {
        jitter += std::abs(static_cast<double>(face.weights[0]) - last);
        lag += std::abs(static_cast<double>(face.weights[3]) - moving);
      }
      last = static_cast<double>(face.weights[0]);
    }
    return std::pair{jitter / 99, lag / 99};
  };
  const auto [free_jitter, free_lag] = jitterAndLag(0.0);
  const auto [jitter, lag] = jitterAndLag(WeightSolverOptions{}.temporal_pull);
  EXPECT_LT(jitter, 0.7 * free_jitter);
  EXPECT_LT(lag, free_lag + 0.01);
}

TEST(WeightSolver, AFaceThatComesBackAfterALongTimeStartsAnew) {
  WeightSolverOptions options;
  options.temporal_pull = 0.05;  // strong, so that it shows
  Character before(syntheticRig({.skin_side = 4}), options), fresh(syntheticRig({.skin_side = 4}), options);
  before.show(someWeights(52, 1));
  before.solve();
  const std::vector<double> other = someWeights(52, 6);
  for (Character* face : {&before, &fresh}) {
    face->frame.t_capture_ns = 10'000'000'000;
    face->show(other);
    face->solve();
  }
  for (std::size_t k = 0; k < 52; ++k) EXPECT_NEAR(before.weights[k], fresh.weights[k], 2e-4) << k;
}

TEST(WeightSolver, APairDiffersOnlyAsFarAsTheMaskSays) {
  rig::Rig rig = syntheticRig({.skin_side = 4, .blendshapes = 4});
  rig.blendshapes[0].name = "puff_L";
  rig.blendshapes[1].name = "puff_R";
  rig.blendshapes[2].name = "clear_L";
  rig.blendshapes[3].name = "clear_R";
  for (const std::size_t k : {0U, 1U})  // the mask hardly shows them
    for (auto& by : rig.blendshapes[k].mask_displacement)
      for (float& x : by) x *= 0.02F;
  const auto difference = [&](double pair_pull) {
    WeightSolverOptions options{.temporal_pull = 0.0};
    options.zero_pull = options.sparsity = 1e-5;
    options.pair_pull = pair_pull;
    Character face(rig, options);
    double hidden = 0;
    for (std::uint32_t seed = 0; seed < 40; ++seed) {
      face.show({0.5, 0.5, 0.9, 0.1}, 0.003, seed);
      face.solve();
      hidden += std::abs(face.weights[0] - face.weights[1]) / 40.0;
      EXPECT_NEAR(face.weights[2], 0.9, 0.05);  // a wink stays a wink
      EXPECT_NEAR(face.weights[3], 0.1, 0.05);
    }
    return hidden;
  };
  EXPECT_LT(difference(WeightSolverOptions{}.pair_pull), 0.7 * difference(0.0));
}

TEST(WeightSolver, WhateverComesInWeightsAreFiniteAndInRange) {
  Character face;
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInf = std::numeric_limits<float>::infinity();
  for (const float bad : {kNan, kInf, -kInf, 3e38F, -3e38F, 1e-40F}) {
    face.show(someWeights(52, 2));
    for (std::size_t p = 0; p < kFeaturePointCount; p += 5) face.displacement[p][p % 3] = bad;
    face.frame.arkit_observed.set();
    face.frame.arkit_weights.fill(bad);
    face.frame.point_confidence[4] = bad;
    face.solve();
    for (const float w : face.weights) {
      EXPECT_TRUE(w >= 0.0F && w <= 1.0F) << bad << ": " << w;
    }
    // ... and the frame after it is none the worse.
    Character fresh;
    face.frame = fresh.frame;
    face.show(someWeights(52, 9));
    fresh.show(someWeights(52, 9));
    face.solve();
    fresh.solve();
    for (std::size_t k = 0; k < face.weights.size(); ++k) EXPECT_NEAR(face.weights[k], fresh.weights[k], 2e-4);
  }
}

TEST(WeightSolver, NonsenseIsRefusedWhenItIsMade) {
  rig::Rig rig = syntheticRig({.skin_side = 4});
  EXPECT_THROW(WeightSolver(rig.blendshapes, 0.0), std::invalid_argument);
  EXPECT_THROW(WeightSolver(rig.blendshapes, std::numeric_limits<double>::quiet_NaN()), std::invalid_argument);
  Character face(rig);
  face.weights.pop_back();
  EXPECT_THROW(face.solve(), std::invalid_argument);
  rig.blendshapes[0].mask_displacement[3][1] = std::numeric_limits<float>::infinity();
  EXPECT_THROW(WeightSolver(rig.blendshapes, 1.0), std::invalid_argument);
  WeightSolver none({}, 1.0);
  none.solve({}, MaskFrame{}, {}, {});
  EXPECT_EQ(none.shapeCount(), 0U);
}

}  // namespace
}  // namespace volto::retarget
