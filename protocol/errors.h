// What went wrong while something was being set up: one line that says what, where, and what to do.
#pragma once

#include <stdexcept>
#include <string>

namespace volto::protocol {

// Thrown by constructors of this folder (Publisher, Subscriber, TakeWriter, TakeReader) and by the functions that parse
// what a person typed. Once a thing runs it no longer throws: it counts, and says so in its counters and in status/.
class SetupError : public std::runtime_error {
 public:
  // The value is the exit status of the command line (architecture.md).
  enum class Kind : int {
    failed = 1,         // it could not be done (a write failed, a file exists and --force was not given)
    usage = 2,          // what was asked makes no sense (not an endpoint, a public address without keys)
    bad_data = 65,      // the bytes are not what they should be (not a take)
    no_input = 66,      // no such file
    unavailable = 69,   // the endpoint is in use, nobody answers
    configuration = 78  // a key file that others can read, an allow-list that does not parse
  };

  SetupError(Kind kind, const std::string& what) : std::runtime_error(what), kind_(kind) {}
  Kind kind() const { return kind_; }
  int exitStatus() const { return static_cast<int>(kind_); }

 private:
  Kind kind_;
};

// The verdict on bytes from outside: either fine, or one line that says what is wrong. Never an exception: bad bytes
// are daily bread.
struct [[nodiscard]] Result {
  std::string problem;  // empty: fine

  bool ok() const { return problem.empty(); }
  explicit operator bool() const { return ok(); }
  static Result bad(std::string what) { return Result{std::move(what)}; }
};

}  // namespace volto::protocol
