// Blendshape weights: ours against QR in every frame and against general non-negative least squares, on a performance.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <random>

#include <benchmark/benchmark.h>

#include "retarget/blendshape_set.h"
#include "retarget/mask_scale.h"
#include "retarget/shape_relations.h"
#include "retarget/weight_solver.h"
#include "rig/mesh_io.h"
#include "tests/bench/reference.h"
#include "tests/bench/report.h"
#include "tests/bench/scene.h"

namespace volto::bench {
namespace {

constexpr std::size_t kFrames = 600;
constexpr std::size_t kRows = 3 * kFeaturePointCount;

// The problem of WeightSolver as one stacked matrix: mask over the square roots of the pulls over those of the pairs.
// Shapes that do not move the mask are left out.
struct Problem {
  const rig::Rig& rig = benchRig().rig;
  // Each frame by itself, as the references see it.
  retarget::WeightSolverOptions options{.temporal_pull = 0.0};
  std::vector<std::size_t> shapes;
  std::vector<std::pair<std::size_t, std::size_t>> pairs;  // columns
  std::size_t rows = 0;
  std::vector<double> a;
  std::vector<std::vector<double>> b;
  std::vector<retarget::MeshMaskDisplacement> displacements;
  std::vector<MaskFrame> frames = performanceMasks(kFrames);

  Problem() {
    const double unit = 1.0 / rig.fapu.fapu.eye_separation;
    for (std::size_t k = 0; k < rig.blendshapes.size(); ++k) {
      if (rig.blendshapes[k].moves_mask) shapes.push_back(k);
    }
    for (const retarget::ShapePair& pair : retarget::shapeRelations(rig.blendshapes, {}).pairs) {
      const auto column = [&](std::uint16_t k) { return std::find(shapes.begin(), shapes.end(), k) - shapes.begin(); };
      pairs.emplace_back(column(pair.left), column(pair.right));
    }
    rows = kRows + shapes.size() + pairs.size();
    a.assign(rows * shapes.size(), 0.0);
    for (std::size_t k = 0; k < shapes.size(); ++k) {
      for (std::size_t i = 0; i < kRows; ++i) {
        a[k * rows + i] = unit * static_cast<double>(rig.blendshapes[shapes[k]].mask_displacement[i / 3][i % 3]);
      }
      a[k * rows + kRows + k] = std::sqrt(options.zero_pull);
    }
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      const std::size_t row = kRows + shapes.size() + i;
      a[pairs[i].first * rows + row] = std::sqrt(options.pair_pull);
      a[pairs[i].second * rows + row] = -std::sqrt(options.pair_pull);
    }
    const retarget::MaskScale scale(rig);
    for (const MaskFrame& frame : frames) {
      scale.apply(frame.displacement_fapu, displacements.emplace_back());
      auto& rhs = b.emplace_back(rows, 0.0);
      for (std::size_t i = 0; i < kRows; ++i) rhs[i] = unit * static_cast<double>(displacements.back()[i / 3][i % 3]);
      // The lasso's term 2 s w, as a pull to below zero.
      for (std::size_t k = 0; k < shapes.size(); ++k) rhs[kRows + k] = -options.sparsity / std::sqrt(options.zero_pull);
    }
  }
};

void weights(benchmark::State& state) {
  static const Problem problem;
  const std::size_t n = problem.shapes.size();
  const LeastSquares reference(problem.a, problem.rows, n);
  retarget::WeightSolver solver(problem.rig, problem.options);
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

// An artist's own set: ICT-FaceKit's 53 expressions as they are, the performance spoken in them. As live, with the pull
// to the frame before; without noise, and with 0.3 % of the eye separation on every coordinate.
void weightsOfOwnSet(benchmark::State& state) {
  const char* data = std::getenv("VOLTO_DATA");
  if (data == nullptr) return state.SkipWithError("needs VOLTO_DATA");
  static const rig::Rig rig = [&] {
    rig::Rig out = benchRig().rig;
    std::vector<std::filesystem::path> files;
    for (const auto& entry :
         std::filesystem::directory_iterator(std::filesystem::path(data) / "meshes/ict/expressions"))
      files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    std::vector<std::string> names;
    std::vector<rig::VertexPositions> meshes;
    for (const auto& file : files) {
      names.push_back(file.stem().string());
      meshes.push_back(rig::readMesh(file).positions);
    }
    retarget::replaceBlendshapes(out, names, meshes);
    return out;
  }();
  const std::size_t n = rig.blendshapes.size();
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  const double noise = state.range(0) != 0 ? 0.003 * rig.fapu.fapu.eye_separation : 0.0;
  // Shapes rise and fall, about a quarter of them at a time: what a talking face looks like to the solver.
  std::vector<retarget::MeshMaskDisplacement> displacements(kFrames);
  std::vector<double> phase(n), speed(n);
  for (std::size_t k = 0; k < n; ++k) {
    phase[k] = 6.28 * std::uniform_real_distribution<double>()(random);
    speed[k] = 0.02 + 0.08 * std::uniform_real_distribution<double>()(random);
  }
  for (std::size_t frame = 0; frame < kFrames; ++frame)
    for (std::size_t p = 0; p < kFeaturePointCount; ++p)
      for (std::size_t axis = 0; axis < 3; ++axis) {
        double sum = noise * normal(random);
        for (std::size_t k = 0; k < n; ++k) {
          const double w = std::max(0.0, std::sin(speed[k] * static_cast<double>(frame) + phase[k]) - 0.7) / 0.3;
          sum += w * static_cast<double>(rig.blendshapes[k].mask_displacement[p][axis]);
        }
        displacements[frame][p][axis] = static_cast<float>(sum);
      }
  retarget::WeightSolver solver(rig);
  MaskFrame in;
  in.point_confidence.fill(1.0F);
  std::vector<float> w(n);
  std::vector<std::uint8_t> observed(n);
  Samples ours;
  std::size_t i = 0;
  double rounds = 0.0;
  for (auto _ : state) {
    const std::size_t frame = i++ % kFrames;
    const double us = timeUs([&] { solver.solve(displacements[frame], in, w, observed); });
    ours.add(us);
    rounds += solver.lastRounds();
    state.SetIterationTime(1e-6 * us);
  }
  state.counters["rounds"] = rounds / static_cast<double>(i);
  char text[80];
  std::snprintf(text, sizeof text, "%.1f us p50, %.1f us p99", ours.median(), ours.quantile(0.99));
  report(std::to_string(n) + " weights of an artist's set" + (noise > 0 ? ", noise 0.3 %" : ""), text, "", "20 us");
}

BENCHMARK(weightsOfOwnSet)
    ->Arg(0)
    ->Arg(1)
    ->Iterations(static_cast<benchmark::IterationCount>(kFrames))
    ->UseManualTime();
BENCHMARK(weights)->Iterations(static_cast<benchmark::IterationCount>(kFrames))->UseManualTime();

}  // namespace
}  // namespace volto::bench
