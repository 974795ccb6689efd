// What the benchmarks found, as one table: ours beside the reference that ran in the same process, in turns.
#pragma once

#include <chrono>
#include <cstddef>
#include <string>
#include <vector>

namespace volto::bench {

// Times of one competitor, microseconds.
class Samples {
 public:
  void add(double us) { us_.push_back(us); }
  double quantile(double q) const;  // 0 when empty
  double median() const { return quantile(0.5); }
  std::size_t size() const { return us_.size(); }

 private:
  std::vector<double> us_;
};

template <typename Call>
double timeUs(Call&& call) {
  const auto start = std::chrono::steady_clock::now();
  call();
  return std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - start).count();
}

// One line of the table: what was measured, the value, what it is measured against, and the aim of it.
void report(const std::string& what, const std::string& value, const std::string& against = {},
            const std::string& aim = {});
std::string microseconds(double us);
std::string times(double ratio);

// Prints the table to standard output.
void printReport();

// Reads more memory than the second-level cache holds, so that what was in it is gone.
void evictCaches();

}  // namespace volto::bench
