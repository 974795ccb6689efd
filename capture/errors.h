// What went wrong with input that a person gave: one line that says what, where, and what to do.
#pragma once

#include <stdexcept>

namespace volto::capture {

// Bad bytes: what() reads "file:line: what is wrong; what to do". The command line exits with 65.
// A file that cannot be opened or read is a std::system_error instead (no such input: 66).
struct InputError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace volto::capture
