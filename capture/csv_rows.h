// Rows of a comma-separated text file, one at a time, from bytes that nobody has checked yet.
//
// Bounded memory: one line of at most kCsvLineLimit bytes is held. Accepted: UTF-8 with or without byte order mark, LF
// or CRLF, with or without a newline at the end, blanks around fields, empty lines. Refused with InputError: UTF-16,
// NUL bytes, control characters in the header, a separator other than the comma, quotes, longer lines, a row with more
// or fewer fields than the header.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "capture/errors.h"

namespace volto::capture {

inline constexpr std::size_t kCsvLineLimit = 64 * 1024;

// Puts up to `size` bytes at `out` and says how many; 0 at the end. Throws std::system_error.
using ByteSource = std::function<std::size_t(char* out, std::size_t size)>;

// "-" is standard input. Throws std::system_error when the file cannot be opened.
ByteSource fileBytes(const std::filesystem::path& path);
// `text` must outlive the source.
ByteSource memoryBytes(std::string_view text);

class CsvRows {
 public:
  // Reads the header line. `name` begins every error.
  CsvRows(ByteSource source, std::string name);

  // Column names without the blanks around them. Valid as long as this object.
  const std::vector<std::string>& columns() const { return columns_; }

  // The next row; false at the end. A last row that has no newline and fewer fields than the header is a file that was
  // cut: it is not returned, and lastRowCut() is true afterwards. Rows shorter than the header but as long as
  // `also_allowed_fields` are returned too.
  bool next();
  void allowShortRows(std::size_t also_allowed_fields) { also_allowed_fields_ = also_allowed_fields; }

  // Of the current row, blanks trimmed; valid until the next call of next().
  const std::vector<std::string_view>& fields() const { return fields_; }
  std::uint64_t line() const { return line_; }       // 1-based
  bool endsWithNewline() const { return newline_; }  // false only for a last line without one
  bool lastRowCut() const { return last_row_cut_; }
  void markLastRowCut() { last_row_cut_ = true; }

  const std::string& name() const { return name_; }
  // Throws InputError "name:line: what".
  [[noreturn]] void fail(const std::string& what) const;
  std::string here() const { return name_ + ":" + std::to_string(line_); }

 private:
  bool readLine(std::string_view& line);
  void readHeader();
  void split(std::string_view line);

  ByteSource source_;
  std::string name_;
  std::vector<char> buffer_;
  std::size_t begin_ = 0, end_ = 0;
  bool source_ended_ = false;
  std::uint64_t line_ = 0;
  bool newline_ = true;
  bool last_row_cut_ = false;
  std::size_t also_allowed_fields_ = 0;
  std::vector<std::string> columns_;
  std::vector<std::string_view> fields_;
};

// A number as a cell holds it. `empty` and `malformed` leave `value` alone; NaN, infinities and numbers too large for a
// double are not_finite.
enum class NumberKind { finite, not_finite, empty, malformed };
NumberKind parseNumber(std::string_view cell, double& value);

// A cell as it may stand in an error message: printable, short, in quotes.
std::string shown(std::string_view cell);

}  // namespace volto::capture
