#include "rig/text_scanner.h"

#include <charconv>
#include <cmath>

#include "rig/errors.h"
#include "rig/mesh_limits.h"

namespace volto::rig {
namespace {

bool isBlank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\f' || c == '\v'; }

}  // namespace

std::string printable(std::string_view word) {
  std::string out;
  for (const char c : word.substr(0, 32)) {
    const auto u = static_cast<unsigned char>(c);
    out += u > 0x20 && u < 0x7F ? c : '?';
  }
  return out;
}

std::string inQuotes(std::string_view word) { return '\'' + printable(word) + '\''; }

TextScanner::TextScanner(std::string_view text, const std::string& name, char comment, std::size_t first_line)
    : text_(text), name_(name), comment_(comment), line_(first_line) {}

void TextScanner::fail(const std::string& what) const {
  throw InputError(name_ + ":" + std::to_string(line_) + ": " + what);
}

bool TextScanner::wordOnLine() {
  while (at_ < text_.size() && isBlank(text_[at_])) ++at_;
  if (at_ < text_.size() && comment_ != '\0' && text_[at_] == comment_) {
    while (at_ < text_.size() && text_[at_] != '\n') ++at_;
  }
  return at_ < text_.size() && text_[at_] != '\n';
}

bool TextScanner::nextWord() {
  while (!wordOnLine()) {
    if (at_ == text_.size()) return false;
    ++at_;
    ++line_;
  }
  return true;
}

void TextScanner::endLine() {
  while (at_ < text_.size() && text_[at_] != '\n') ++at_;
  if (at_ < text_.size()) {
    ++at_;
    ++line_;
  }
}

std::string_view TextScanner::word() {
  const std::size_t start = at_;
  while (at_ < text_.size() && !isBlank(text_[at_]) && text_[at_] != '\n' &&
         !(comment_ != '\0' && text_[at_] == comment_)) {
    const auto c = static_cast<unsigned char>(text_[at_]);
    if (c < 0x20 || c == 0x7F) fail("a control character (byte " + std::to_string(c) + ") in the text");
    if (++at_ - start > kMaxLineBytes) fail("a word longer than 65536 bytes");
  }
  return text_.substr(start, at_ - start);
}

double TextScanner::number(const char* what) {
  const std::string_view text = word();
  std::string_view digits = text;
  if (digits.starts_with('+') && !digits.substr(1).starts_with('-')) digits.remove_prefix(1);
  double value = 0;
  const auto [stop, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  bool good = stop == digits.data() + digits.size() && error != std::errc::invalid_argument;
  if (good && error == std::errc::result_out_of_range) {
    // Too small counts as zero, too large is not finite.
    good = digits.find("e-") != digits.npos || digits.find("E-") != digits.npos;
    value = 0;
  }
  if (!good || !std::isfinite(value)) fail(std::string(what) + ": '" + printable(text) + "' is not a finite number");
  return value;
}

std::int64_t TextScanner::integer(const char* what) {
  const std::string_view text = word();
  std::int64_t value = 0;
  const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || stop != text.data() + text.size())
    fail(std::string(what) + ": '" + printable(text) + "' is not a whole number");
  return value;
}

}  // namespace volto::rig
