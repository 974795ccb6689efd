#include "tests/bench/report.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <iostream>

namespace volto::bench {
namespace {

struct Line {
  std::string what, value, against, aim;
};

std::vector<Line>& lines() {
  static std::vector<Line> all;
  return all;
}

std::string format(const char* pattern, double value) {
  char text[64];
  std::snprintf(text, sizeof text, pattern, value);
  return text;
}

}  // namespace

double Samples::quantile(double q) const {
  if (us_.empty()) return 0.0;
  std::vector<double> sorted = us_;
  const auto rank = static_cast<std::ptrdiff_t>(std::lround(q * static_cast<double>(sorted.size() - 1)));
  std::nth_element(sorted.begin(), sorted.begin() + rank, sorted.end());
  return sorted[static_cast<std::size_t>(rank)];
}

void report(const std::string& what, const std::string& value, const std::string& against, const std::string& aim) {
  // Google Benchmark may run a function more than once: the last one counts.
  for (Line& line : lines()) {
    if (line.what == what && line.against == against) {
      line.value = value;
      return;
    }
  }
  lines().push_back({what, value, against, aim});
}

std::string microseconds(double us) {
  return us < 10.0 ? format("%.2f us", us) : us < 1000.0 ? format("%.0f us", us) : format("%.0f us", us);
}
std::string times(double ratio) { return ratio < 10.0 ? format("%.2fx", ratio) : format("%.0fx", ratio); }

void printReport() {
  if (lines().empty()) return;
  std::cout << "\n| what | measured | against | aim |\n|---|---|---|---|\n";
  for (const Line& line : lines()) {
    std::cout << "| " << line.what << " | " << line.value << " | " << line.against << " | " << line.aim << " |\n";
  }
}

void evictCaches() {
  // Read, not written: else the call that is timed would also pay for writing these lines back.
  static const std::vector<std::uint64_t> memory(6U << 17U, 1);  // 6 MiB
  static volatile std::uint64_t sink = 0;
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < memory.size(); i += 8) sum += memory[i];
  sink = sink + sum;
}

}  // namespace volto::bench
