#include "tools/cli/nearest_match.h"

#include <algorithm>
#include <cstddef>
#include <vector>

namespace volto::cli {

namespace {

// Optimal string alignment distance.
std::size_t editDistance(std::string_view a, std::string_view b) {
  const std::size_t width = b.size() + 1;
  std::vector<std::size_t> before_last(width), last(width), row(width);
  for (std::size_t j = 0; j < width; ++j) last[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    row[0] = i;
    for (std::size_t j = 1; j < width; ++j) {
      const std::size_t change = a[i - 1] == b[j - 1] ? 0 : 1;
      row[j] = std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + change});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        row[j] = std::min(row[j], before_last[j - 2] + 1);
    }
    before_last.swap(last);
    last.swap(row);
  }
  return last[b.size()];
}

}  // namespace

std::string nearestMatch(std::string_view typed, std::span<const std::string> known) {
  constexpr std::size_t kLongestWord = 64;  // what is longer is no mistyped word
  if (typed.empty() || typed.size() > kLongestWord) return {};
  std::string best;
  std::size_t best_distance = kLongestWord;
  for (const std::string& word : known) {
    const bool begins = typed.size() >= 2 && word.starts_with(typed);
    const std::size_t distance = begins ? 0 : editDistance(typed, word);
    if (distance < best_distance && (begins || 3 * distance <= std::max(typed.size(), word.size()))) {
      best = word;
      best_distance = distance;
    }
  }
  return best;
}

}  // namespace volto::cli
