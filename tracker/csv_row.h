// One line of the small CSV files that travel inside the library. Internal to the tracker.
#pragma once

#include <charconv>
#include <stdexcept>
#include <string>
#include <string_view>

namespace volto::tracker {

class CsvRow {
 public:
  CsvRow(std::string_view line, std::string where) : rest_(line), where_(std::move(where)) {}

  std::string_view field() {
    ++column_;
    if (done_) fail("is missing");
    const std::size_t comma = rest_.find(',');
    const std::string_view text = rest_.substr(0, comma);
    done_ = comma == std::string_view::npos;
    rest_ = done_ ? std::string_view{} : rest_.substr(comma + 1);
    return text;
  }

  double number(double low, double high) {
    const std::string_view text = field();
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc{} || end != text.data() + text.size() || !(value >= low && value <= high))
      fail(std::string(text)
               .append(" is not a number from ")
               .append(std::to_string(low))
               .append(" to ")
               .append(std::to_string(high)));
    return value;
  }

  void expectEnd() const {
    if (!done_) fail("is followed by one too many");
  }

  [[noreturn]] void fail(const std::string& what) const {
    throw std::invalid_argument(
        std::string(where_).append(": column ").append(std::to_string(column_)).append(" ").append(what));
  }

 private:
  std::string_view rest_;
  std::string where_;
  int column_ = 0;
  bool done_ = false;
};

// Calls `row(CsvRow&)` for each line that is neither empty nor a comment ('#').
template <typename Row>
void forEachCsvRow(std::string_view csv, const std::string& name, Row&& row) {
  for (int line_number = 1; !csv.empty(); ++line_number) {
    const std::size_t newline = csv.find('\n');
    std::string_view line = csv.substr(0, newline);
    csv = newline == std::string_view::npos ? std::string_view{} : csv.substr(newline + 1);
    if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
    if (line.empty() || line.front() == '#') continue;
    CsvRow current(line, std::string(name).append(":").append(std::to_string(line_number)));
    row(current);
  }
}

}  // namespace volto::tracker
