// Network: a neural network in a file, run on the CPU through OpenCV. The only place that sees OpenCV.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "capture/errors.h"

namespace volto::capture {

// Thread-bound. What OpenCV allocates inside is its own matter; nothing else is allocated per run.
class Network {
 public:
  // From the bytes of an ONNX file; `name` begins every error. Loads it and runs it once on a grey picture, so that a
  // file that is no network, or one that gives nothing finite, is told here and not in the middle of a show. Throws
  // InputError.
  Network(std::string_view onnx, const std::string& name, int width, int height);
  ~Network();
  Network(Network&&) noexcept;
  Network& operator=(Network&&) noexcept;

  // 1 x 3 x height x width, to be filled before run().
  std::span<float> input();

  struct Output {
    std::string name;
    std::vector<int> shape;
    std::span<const float> values;  // valid until the next run()
  };
  // In the order of the file. Throws InputError when the network cannot be run.
  const std::vector<Output>& run();
  // Of the last run; null when there is none of that name.
  const Output* output(std::string_view name) const;
  const std::vector<Output>& outputs() const;
  // Spent in run(), of all runs.
  std::int64_t spent_ns() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

// How many threads all networks of the process may use together. 0: as many as there are processors. Other numbers of
// threads give other rounding errors (the last bit), so with a fixed number the same picture gives the same landmarks.
void setNetworkThreads(int threads);
// From now on each network finds out by itself whether one thread or all are quicker (thread_choice.h).
void measureNetworkThreads();
// The version of OpenCV in use: "4.6.0".
std::string openCvVersion();

}  // namespace volto::capture
