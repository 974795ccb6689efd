// Everything but decoding and network, as a part of one landmark inference: PFLD, 112 x 112, by OpenCV's dnn module.
#include <filesystem>
#include <opencv2/dnn.hpp>

#include <benchmark/benchmark.h>

#include "tests/bench/pipeline_cost.h"
#include "tests/bench/report.h"
#include "tests/support/test_data.h"

namespace volto::bench {
namespace {

void landmarkInference(benchmark::State& state) {
  const auto data = test::dataDir();
  if (!data || !std::filesystem::exists(*data / "models/pfld_68.onnx")) {
    state.SkipWithError("no model: set VOLTO_DATA");
    return;
  }
  cv::dnn::Net net = cv::dnn::readNetFromONNX((*data / "models/pfld_68.onnx").string());
  const cv::Mat image(112, 112, CV_8UC3, cv::Scalar(120, 130, 140));
  const cv::Mat blob = cv::dnn::blobFromImage(image, 1.0 / 255.0);
  Samples us;
  net.setInput(blob);
  net.forward();
  for (auto _ : state) {
    net.setInput(blob);
    const double one = timeUs([&] { benchmark::DoNotOptimize(net.forward().data); });
    us.add(one);
    state.SetIterationTime(1e-6 * one);
  }
  state.counters["us"] = us.median();
  const double cost = pipelineCostUs();
  if (cost <= 0.0) return;
  state.counters["ours_percent"] = 100.0 * cost / us.median();
  char text[32];
  std::snprintf(text, sizeof text, "%.1f %%", 100.0 * cost / us.median());
  report("tracker, retarget and encoding", text, "of one PFLD landmark inference: " + microseconds(us.median()),
         "at most 5 %");
}

BENCHMARK(landmarkInference)->Iterations(60)->UseManualTime()->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace volto::bench
