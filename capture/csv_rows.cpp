#include "capture/csv_rows.h"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <fcntl.h>
#include <memory>
#include <system_error>
#include <unistd.h>
#include <utility>

namespace volto::capture {
namespace {

bool isBlank(char c) { return c == ' ' || c == '\t'; }

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && isBlank(text.front())) text.remove_prefix(1);
  while (!text.empty() && isBlank(text.back())) text.remove_suffix(1);
  return text;
}

std::string hexByte(unsigned char byte) {
  char text[8];
  std::snprintf(text, sizeof text, "0x%02X", byte);
  return text;
}

// Position of the first byte that no text of column names holds (controls, invalid UTF-8), or npos.
std::size_t firstByteThatIsNotText(std::string_view text) {
  for (std::size_t i = 0; i < text.size();) {
    const auto byte = static_cast<unsigned char>(text[i]);
    std::size_t follow = 0;
    if (byte < 0x20 ? byte != '\t' : byte == 0x7F) return i;
    if (byte >= 0x80) {
      if (byte >= 0xC2 && byte <= 0xDF)
        follow = 1;
      else if (byte >= 0xE0 && byte <= 0xEF)
        follow = 2;
      else if (byte >= 0xF0 && byte <= 0xF4)
        follow = 3;
      else
        return i;
      for (std::size_t k = 1; k <= follow; ++k) {
        if (i + k >= text.size() || (static_cast<unsigned char>(text[i + k]) & 0xC0) != 0x80) return i;
      }
    }
    i += follow + 1;
  }
  return std::string_view::npos;
}

// An open file that closes itself.
struct File {
  int fd = -1;
  bool owned = true;
  ~File() {
    if (owned && fd >= 0) ::close(fd);
  }
};

}  // namespace

ByteSource fileBytes(const std::filesystem::path& path) {
  auto file = std::make_shared<File>();
  std::string name = path.string();
  if (path == "-") {
    file->fd = STDIN_FILENO;
    file->owned = false;
    name = "standard input";
  } else {
    file->fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
    if (file->fd < 0) throw std::system_error(errno, std::generic_category(), name + ": cannot be opened");
  }
  return [file, name](char* out, std::size_t size) -> std::size_t {
    for (;;) {
      const ssize_t got = ::read(file->fd, out, size);
      if (got >= 0) return static_cast<std::size_t>(got);
      if (errno != EINTR) throw std::system_error(errno, std::generic_category(), name + ": cannot be read");
    }
  };
}

ByteSource memoryBytes(std::string_view text) {
  return [text](char* out, std::size_t size) mutable -> std::size_t {
    const std::size_t n = std::min(size, text.size());
    if (n > 0) std::memcpy(out, text.data(), n);
    text.remove_prefix(n);
    return n;
  };
}

CsvRows::CsvRows(ByteSource source, std::string name) : source_(std::move(source)), name_(std::move(name)) {
  if (name_ == "-") name_ = "standard input";
  buffer_.resize(2 * kCsvLineLimit);
  readHeader();
}

void CsvRows::fail(const std::string& what) const { throw InputError(here() + ": " + what); }

bool CsvRows::readLine(std::string_view& line) {
  std::size_t searched = begin_;
  for (;;) {
    const void* found = searched < end_ ? std::memchr(buffer_.data() + searched, '\n', end_ - searched) : nullptr;
    const std::size_t stop =
        found != nullptr ? static_cast<std::size_t>(static_cast<const char*>(found) - buffer_.data()) : end_;
    const std::size_t length = stop - begin_;
    if (length > kCsvLineLimit) {
      ++line_;
      fail("the line is longer than 64 KiB; is this a CSV file with one frame per line?");
    }
    if (found != nullptr || (source_ended_ && length > 0)) {
      ++line_;
      newline_ = found != nullptr;
      line = std::string_view(buffer_.data() + begin_, length);
      begin_ = newline_ ? stop + 1 : stop;
      if (const auto nul = line.find('\0'); nul != std::string_view::npos) {
        fail("byte " + std::to_string(nul + 1) + " of the line is NUL; this is not a text file, or it was damaged");
      }
      if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
      return true;
    }
    if (source_ended_) return false;
    if (begin_ > 0) {
      std::memmove(buffer_.data(), buffer_.data() + begin_, length);
      begin_ = 0;
      end_ = length;
    }
    searched = end_;
    const std::size_t got = source_(buffer_.data() + end_, buffer_.size() - end_);
    if (got == 0) source_ended_ = true;
    end_ += got;
  }
}

void CsvRows::readHeader() {
  // The first bytes say what kind of file this is.
  while (end_ < 4 && !source_ended_) {
    const std::size_t got = source_(buffer_.data() + end_, buffer_.size() - end_);
    if (got == 0) source_ended_ = true;
    end_ += got;
  }
  const std::string_view start(buffer_.data(), end_);
  line_ = 1;
  if (start.empty()) fail("the file is empty; a header line with column names is expected");
  const bool utf16 = start.starts_with("\xFF\xFE") || start.starts_with("\xFE\xFF") ||
                     (start.size() >= 4 && (start[0] == '\0') != (start[1] == '\0') &&
                      (start[0] == '\0') == (start[2] == '\0') && (start[1] == '\0') == (start[3] == '\0'));
  if (utf16) fail("the text is UTF-16; save it as UTF-8");
  if (start.starts_with("SQLite format 3")) fail("this is an SQLite file (a take?), not a CSV file");
  if (start.starts_with("\xEF\xBB\xBF")) begin_ = 3;

  line_ = 0;
  std::string_view line;
  do {
    if (!readLine(line)) {
      line_ = 1;
      fail("the file holds no text; a header line with column names is expected");
    }
  } while (trimmed(line).empty());
  if (const auto at = firstByteThatIsNotText(line); at != std::string_view::npos) {
    fail("byte " + hexByte(static_cast<unsigned char>(line[at])) + " at place " + std::to_string(at + 1) +
         " is not text; this is not a CSV file");
  }
  if (line.find(',') == std::string_view::npos) {
    for (const auto& [separator, said] : {std::pair{';', "';'"}, std::pair{'\t', "a tab"}}) {
      if (line.find(separator) != std::string_view::npos) {
        fail(std::string("columns are separated by ") + said +
             "; save the file with ',' between columns and '.' in numbers");
      }
    }
  }
  if (line.find('"') != std::string_view::npos) fail("the header holds quotes; save the file without quotes");
  split(line);
  columns_.assign(fields_.begin(), fields_.end());
}

void CsvRows::split(std::string_view line) {
  fields_.clear();
  for (;;) {
    const auto comma = line.find(',');
    fields_.push_back(trimmed(line.substr(0, comma)));
    if (comma == std::string_view::npos) return;
    line.remove_prefix(comma + 1);
  }
}

bool CsvRows::next() {
  std::string_view line;
  do {
    if (!readLine(line)) return false;
  } while (trimmed(line).empty());
  split(line);
  const std::size_t expected = columns_.size(), found = fields_.size();
  // A comma at the very end of a line is common and harmless.
  if (found == expected + 1 && fields_.back().empty()) {
    fields_.pop_back();
    return true;
  }
  if (found == expected) return true;
  if (found < expected) {
    if (!newline_) {
      last_row_cut_ = true;
      return false;
    }
    if (also_allowed_fields_ > 0 && found == also_allowed_fields_) return true;
  }
  std::string hint = "the file is damaged or was edited";
  if (line.find('"') != std::string_view::npos)
    hint = "quotes are not supported; save the file without them";
  else if (line.find(';') != std::string_view::npos)
    hint = "columns must be separated by ','";
  else if (found > expected + expected / 2)
    hint = "are the numbers written with a decimal comma? Save them with '.'";
  fail("the row has " + std::to_string(found) + " fields, the header " + std::to_string(expected) + "; " + hint);
}

NumberKind parseNumber(std::string_view cell, double& value) {
  if (cell.empty()) return NumberKind::empty;
  if (cell.size() > 1 && cell[0] == '+' && cell[1] != '-') cell.remove_prefix(1);
  double parsed = 0.0;
  const auto [stop, error] = std::from_chars(cell.data(), cell.data() + cell.size(), parsed);
  if (error == std::errc::invalid_argument || stop != cell.data() + cell.size()) return NumberKind::malformed;
  if (error == std::errc::result_out_of_range) {
    // Too small is zero for every purpose here; too large is not a number that anything can be done with.
    const auto exponent = cell.find_first_of("eE");
    if (exponent == std::string_view::npos || exponent + 1 >= cell.size() || cell[exponent + 1] != '-') {
      return NumberKind::not_finite;
    }
    value = 0.0;
    return NumberKind::finite;
  }
  if (!std::isfinite(parsed)) return NumberKind::not_finite;
  value = parsed;
  return NumberKind::finite;
}

std::string shown(std::string_view cell) {
  constexpr std::size_t kShown = 24;
  std::string text = "'";
  for (const char c : cell.substr(0, kShown)) text += static_cast<unsigned char>(c) < 0x20 || c == 0x7F ? '?' : c;
  if (cell.size() > kShown) text += "...";
  return text + "'";
}

}  // namespace volto::capture
