// Blendshape weights: ours against QR in every frame and against general non-negative least squares, on a performance.
#include <algorithm>
#include <cmath>

#include <benchmark/benchmark.h>

#include "retarget/mask_scale.h"
#include "retarget/weight_solver.h"
#include "tests/bench/reference.h"
#include "tests/bench/report.h"
#include "tests/bench/scene.h"

namespace volto::bench {
namespace {

constexpr std::size_t kFrames = 600;
constexpr std::size_t kRows = 3 * kFeaturePointCount;

// The problem of WeightSolver as one stacked matrix: mask over the square roots of the pulls. Shapes that do not move
// the mask are left out.
struct Problem {
  const rig::Rig& rig = benchRig().rig;
  retarget::WeightSolverOptions options;
  std::vector<std::size_t> shapes;
  std::vector<double> a;
  std::vector<std::vector<double>> b;
  std::vector<retarget::MeshMaskDisplacement> displacements;
  std::vector<MaskFrame> frames = performanceMasks(kFrames);

  Problem() {
    const double unit = 1.0 / rig.fapu.fapu.eye_separation;
    for (std::size_t k = 0; k < rig.blendshapes.size(); ++k) {
      if (rig.blendshapes[k].moves_mask) shapes.push_back(k);
    }
    const std::size_t rows = kRows + shapes.size();
    a.assign(rows * shapes.size(), 0.0);
    for (std::size_t k = 0; k < shapes.size(); ++k) {
      for (std::size_t i = 0; i < kRows; ++i) {
        a[k * rows + i] = unit * static_cast<double>(rig.blendshapes[shapes[k]].mask_displacement[i / 3][i % 3]);
      }
      a[k * rows + kRows + k] = std::sqrt(options.zero_pull);
    }
    const retarget::MaskScale scale(rig);
    for (const MaskFrame& frame : frames) {
      scale.apply(frame.displacement_fapu, displacements.emplace_back());
      auto& rhs = b.emplace_back(rows, 0.0);
      for (std::size_t i = 0; i < kRows; ++i) rhs[i] = unit * static_cast<double>(displacements.back()[i / 3][i % 3]);
    }
  }
};

void weights(benchmark::State& state) {
  static const Problem problem;
  const std::size_t n = problem.shapes.size();
  const LeastSquares reference(problem.a, kRows + n, n);
  retarget::WeightSolver solver(problem.rig.blendshapes, problem.rig.fapu.fapu.eye_separation, problem.options);
  std::vector<float> w(solver.shapeCount());
  std::vector<std::uint8_t> observed(solver.shapeCount());
  std::vector<double> by_qr(n), by_nnls(n), exact(n), errors;
  Samples ours, qr, nnls;
  std::size_t i = 0;
  double rounds = 0.0;
  for (auto _ : state) {
    const std::size_t frame = i++ % kFrames;
    const double us = timeUs([&] { solver.solve(problem.displacements[frame], problem.frames[frame], w, observed); });
    ours.add(us);
    rounds += solver.lastRounds();
    state.SetIterationTime(1e-6 * us);
    if (frame % 3 == 0) {
      qr.add(timeUs([&] { reference.byQr(problem.b[frame], by_qr); }));
      nnls.add(timeUs([&] { reference.byNnls(problem.b[frame], by_nnls); }));
    }
    if (frame % 12 == 0) {
      reference.exact(problem.b[frame], exact);
      double worst = 0.0;
      for (std::size_t k = 0; k < n; ++k)
        worst = std::max(worst, std::abs(static_cast<double>(w[problem.shapes[k]]) - exact[k]));
      errors.push_back(worst);
    }
  }
  std::sort(errors.begin(), errors.end());
  const double p99 = errors[(errors.size() - 1) * 99 / 100];
  const double us = ours.median();
  state.counters["us_p50"] = us;
  state.counters["us_p99"] = ours.quantile(0.99);
  state.counters["qr_x"] = qr.median() / us;
  state.counters["nnls_x"] = nnls.median() / us;
  state.counters["error_p99"] = p99;
  state.counters["rounds"] = rounds / static_cast<double>(i);

  const std::string what = std::to_string(n) + " weights from the mask";
  char text[80];
  std::snprintf(text, sizeof text, "%.1f us p50, %.1f us p99", us, ours.quantile(0.99));
  report(what, text);
  report(what, times(qr.median() / us) + " faster", "QR in every frame, clamped: " + microseconds(qr.median()), "7x");
  report(what, times(nnls.median() / us) + " faster", "general NNLS: " + microseconds(nnls.median()), "20x");
  std::snprintf(text, sizeof text, "%.1e", p99);
  report(what + ", worst error p99", text, "exact bounded solution", "1e-3");
}

BENCHMARK(weights)->Iterations(static_cast<benchmark::IterationCount>(kFrames))->UseManualTime();

}  // namespace
}  // namespace volto::bench
