// Words, numbers and lines of a text mesh format, with the line for errors. No locale: numbers by std::from_chars.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace volto::rig {

// Borrows the text and the name, which must outlive it. Thread-bound.
class TextScanner {
 public:
  // `comment`: the character that begins a comment, which is passed over up to the end of its line; '\0' for none.
  // `first_line`: number of the line that the text begins in.
  TextScanner(std::string_view text, const std::string& name, char comment = '\0', std::size_t first_line = 1);

  // Throws InputError "name:line: what".
  [[noreturn]] void fail(const std::string& what) const;

  bool atEnd() const { return at_ == text_.size(); }
  std::size_t line() const { return line_; }
  std::size_t offset() const { return at_; }
  std::size_t bytesLeft() const { return text_.size() - at_; }

  // To the next word of this line; false when the line (or the text) ends first. Does not leave the line.
  bool wordOnLine();
  // To the next word, over empty lines and comments; false at the end of the text.
  bool nextWord();
  // To the beginning of the next line.
  void endLine();

  // The word at which the scanner stands, which is then passed. Throws when it is longer than a line may be.
  std::string_view word();
  // The same as a number. `what` says whose number it is. Throws when it is none, or not finite.
  double number(const char* what);
  std::int64_t integer(const char* what);

 private:
  std::string_view text_;
  const std::string& name_;
  char comment_;
  std::size_t at_ = 0;
  std::size_t line_;
};

// A word as it can be shown in a message: short, printable.
std::string printable(std::string_view word);
// The same between quotation marks.
std::string inQuotes(std::string_view word);

}  // namespace volto::rig
