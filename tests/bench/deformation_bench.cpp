// Mesh deformation: ours against a copy of the result, the generic sparse product, and solving the RBF systems anew in
// every frame.
#include <cmath>
#include <cstring>

#include <benchmark/benchmark.h>

#include "retarget/deform_kernel.h"
#include "retarget/deformer.h"
#include "retarget/mask_scale.h"
#include "tests/bench/reference.h"
#include "tests/bench/report.h"
#include "tests/bench/scene.h"

namespace volto::bench {
namespace {

struct Competitors {
  const rig::Rig& rig = benchRig().rig;
  std::vector<Float3> neutral = neutralVertices(rig);
  retarget::Deformer ours{rig.deformation, neutral};
  EigenDeform eigen{rig.deformation.row_start, rig.deformation.point, rig.deformation.weight, neutral};
  std::vector<std::vector<std::uint8_t>> regions{rig.region_of_influence.begin(), rig.region_of_influence.end()};
  PerFrameRbf per_frame{neutralControls(rig), regions, rig.association.triangle, neutral};
  std::vector<retarget::MeshMaskDisplacement> displacements;
  std::vector<Float3> out = neutral, copy = neutral;

  Competitors() {
    const retarget::MaskScale scale(rig);
    for (const MaskFrame& frame : performanceMasks(64))
      scale.apply(frame.displacement_fapu, displacements.emplace_back());
  }
};

// Worst distance to the product in double precision, as a fraction of the eye separation.
double worstError(const Competitors& c, const std::vector<Float3>& mesh, const retarget::MeshMaskDisplacement& d) {
  double worst = 0.0;
  const auto& op = c.rig.deformation;
  for (std::size_t v = 0; v < mesh.size(); ++v) {
    double sum[3];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      sum[axis] = c.rig.neutral.positions(static_cast<Eigen::Index>(v), static_cast<Eigen::Index>(axis)) -
                  static_cast<double>(mesh[v][axis]);
      for (std::uint32_t i = op.row_start[v]; i < op.row_start[v + 1]; ++i) {
        sum[axis] += static_cast<double>(op.weight[i]) * static_cast<double>(d[op.point[i]][axis]);
      }
    }
    worst = std::max(worst, std::hypot(sum[0], sum[1], sum[2]));
  }
  return worst / c.rig.fapu.fapu.eye_separation;
}

void deformation(benchmark::State& state, bool cold) {
  static Competitors c;
  Samples ours, memcpy_us, csr, eigen, per_frame;
  std::size_t frame = 0;
  const auto measure = [&](Samples& samples, auto&& call) {
    if (cold) {
      evictCaches();
    } else {
      // The competitor before it has had the caches and the branch predictor for itself.
      for (int warm_up = 0; warm_up < 4; ++warm_up) call();
    }
    const double us = timeUs(call);
    samples.add(us);
    return us;
  };
  for (auto _ : state) {
    const auto& d = c.displacements[frame++ % c.displacements.size()];
    state.SetIterationTime(1e-6 * measure(ours, [&] { c.ours.deform(d, c.out); }));
    benchmark::DoNotOptimize(c.out.data());
    measure(memcpy_us, [&] { std::memcpy(c.copy.data(), c.out.data(), c.out.size() * sizeof(Float3)); });
    benchmark::DoNotOptimize(c.copy.data());
    measure(csr, [&] {
      csrDeform(c.rig.deformation.row_start, c.rig.deformation.point, c.rig.deformation.weight, c.neutral, d, c.copy);
    });
    measure(eigen, [&] { c.eigen.deform(d, c.copy); });
    measure(per_frame, [&] { c.per_frame.deform(d, c.copy); });
    benchmark::DoNotOptimize(c.copy.data());
  }
  double error = 0.0;
  for (const auto& d : c.displacements) {
    c.ours.deform(d, c.out);
    error = std::max(error, worstError(c, c.out, d));
  }
  const double us = ours.median();
  state.counters["us"] = us;
  state.counters["x_memcpy"] = us / memcpy_us.median();
  state.counters["csr_x"] = csr.median() / us;
  state.counters["eigen_x"] = eigen.median() / us;
  state.counters["per_frame_x"] = per_frame.median() / us;
  state.counters["error_es"] = error;

  const std::string what = "deform " + benchRig().name + ", " + std::to_string(c.neutral.size()) + " vertices, " +
                           (cold ? "cold" : "hot") + " (" + retarget::deformKernelTarget() + ")";
  report(what, microseconds(us),
         "copy of the result: " + microseconds(memcpy_us.median()) + ", we take " + times(us / memcpy_us.median()),
         cold ? "at most 5x" : "at most 8x");
  report(what, times(csr.median() / us) + " faster", "compressed rows, plain loop: " + microseconds(csr.median()),
         "7x");
  report(what, times(eigen.median() / us) + " faster", "Eigen sparse x dense: " + microseconds(eigen.median()), "7x");
  report(what, times(per_frame.median() / us) + " faster",
         "136 RBF systems a frame: " + microseconds(per_frame.median()), "25x");
  char text[160];
  std::snprintf(text, sizeof text, "%.1e ES worst", error);
  report("deform, error against double precision", text, "", "1e-4 ES");
  std::snprintf(text, sizeof text, "%zu entries, %zu packed; %zu vertices move in the per-frame reference",
                c.ours.entryCount(), c.ours.packedEntryCount(), c.per_frame.movedVertexCount());
  report("deform, operator", text);
}

BENCHMARK_CAPTURE(deformation, hot, false)->Iterations(300)->UseManualTime();
BENCHMARK_CAPTURE(deformation, cold, true)->Iterations(100)->UseManualTime();

}  // namespace
}  // namespace volto::bench
