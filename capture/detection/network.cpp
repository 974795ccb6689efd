#include "capture/detection/network.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <optional>
#include <string>

#if defined(__SSE__)
#include <pmmintrin.h>
#include <xmmintrin.h>
#endif

#include <opencv2/core/utils/logger.hpp>
#include <opencv2/dnn.hpp>

#include "capture/detection/thread_choice.h"

namespace volto::capture {
namespace {

// Networks meet numbers so small that the processor handles them a hundred times slower; while one runs they count as
// zero. OpenCV hands the mode on to its worker threads. The rest of Volto keeps exact arithmetic.
class FlushToZero {
 public:
#if defined(__SSE__)
  FlushToZero() : before_(_mm_getcsr()) { _mm_setcsr(before_ | _MM_FLUSH_ZERO_ON | _MM_DENORMALS_ZERO_ON); }
  ~FlushToZero() { _mm_setcsr(before_); }

 private:
  unsigned before_;
#else
  FlushToZero() = default;
#endif
 public:
  FlushToZero(const FlushToZero&) = delete;
  FlushToZero& operator=(const FlushToZero&) = delete;
};

std::atomic<bool> threads_are_measured{false};

// OpenCV makes its threads anew even when their number stays.
void useThreads(int threads) {
  if (cv::getNumThreads() != threads) cv::setNumThreads(threads);
}

std::int64_t nowNs() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

// OpenCV's messages run over several lines and name its own source files; the reason is in between.
std::string reasonOf(const cv::Exception& error) {
  std::string text = error.err.empty() ? error.msg : error.err;
  std::replace(text.begin(), text.end(), '\n', ' ');
  constexpr std::size_t kEnough = 160;
  if (text.size() > kEnough) text = text.substr(0, kEnough) + "...";
  return text;
}

}  // namespace

struct Network::State {
  cv::dnn::Net net;
  cv::Mat input;
  std::string name;
  std::vector<std::string> names;
  std::vector<cv::Mat> mats;
  std::vector<Output> outputs;
  std::optional<ThreadChoice> threads;
  std::int64_t spent_ns = 0;

  void forward() {
    const FlushToZero flush;
    const bool measured = threads_are_measured;
    if (measured) {
      if (!threads) threads.emplace(cv::getNumberOfCPUs());
      useThreads(threads->threads());  // of the process, not of this network; takes a microsecond
    }
    const std::int64_t before = nowNs();
    net.setInput(input);
    net.forward(mats, names);
    const std::int64_t took = nowNs() - before;
    spent_ns += took;
    if (measured) threads->took(took);
  }
};

Network::Network(std::string_view onnx, const std::string& name, int width, int height)
    : state_(std::make_unique<State>()) {
  cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);  // what goes wrong is told here, in one line
  State& s = *state_;
  s.name = name;
  try {
    s.net = cv::dnn::readNetFromONNX(onnx.data(), onnx.size());
    if (s.net.empty()) throw InputError(name + ": holds no network; give an ONNX file");
    s.net.setPreferableBackend(cv::dnn::DNN_BACKEND_OPENCV);
    s.net.setPreferableTarget(cv::dnn::DNN_TARGET_CPU);
    s.names = s.net.getUnconnectedOutLayersNames();
  } catch (const cv::Exception& error) {
    throw InputError(name + ": OpenCV " + CV_VERSION + " cannot read it as ONNX (" + reasonOf(error) +
                     "); is it a model file, whole, and of a kind that this version knows?");
  }
  const int shape[] = {1, 3, height, width};
  s.input.create(4, shape, CV_32F);
  s.input.setTo(cv::Scalar(0.5));
  for (const Output& output : run()) {
    for (const float value : output.values) {
      if (!std::isfinite(value)) throw InputError(name + ": gives numbers that are not finite; the file is damaged");
    }
  }
  s.spent_ns = 0;  // the first run prepares; it is no measure of those to come
  s.threads.reset();
}

Network::~Network() = default;
Network::Network(Network&&) noexcept = default;
Network& Network::operator=(Network&&) noexcept = default;

std::span<float> Network::input() { return {state_->input.ptr<float>(), state_->input.total()}; }

const std::vector<Network::Output>& Network::run() {
  State& s = *state_;
  try {
    s.forward();
  } catch (const cv::Exception& error) {
    throw InputError(s.name + ": cannot be run on a picture of " + std::to_string(s.input.size[3]) + "x" +
                     std::to_string(s.input.size[2]) + " (" + reasonOf(error) + "); does its manifest fit it?");
  }
  s.outputs.resize(s.mats.size());
  for (std::size_t i = 0; i < s.mats.size(); ++i) {
    const cv::Mat& mat = s.mats[i];
    if (mat.type() != CV_32F || !mat.isContinuous())
      throw InputError(s.name + ": its output " + s.names[i] + " does not hold plain 32-bit numbers");
    Output& out = s.outputs[i];
    out.name = s.names[i];
    out.shape.assign(mat.size.p, mat.size.p + mat.dims);
    out.values = {mat.ptr<float>(), mat.total()};
  }
  return s.outputs;
}

const Network::Output* Network::output(std::string_view name) const {
  for (const Output& output : state_->outputs)
    if (output.name == name) return &output;
  return nullptr;
}

const std::vector<Network::Output>& Network::outputs() const { return state_->outputs; }

std::int64_t Network::spent_ns() const { return state_->spent_ns; }

void setNetworkThreads(int threads) {
  threads_are_measured = false;
  useThreads(threads > 0 ? threads : cv::getNumberOfCPUs());
}

void measureNetworkThreads() { threads_are_measured = true; }

std::string openCvVersion() { return cv::getVersionString(); }

}  // namespace volto::capture
