// What went wrong with input that a person gave: one line that says what, where, and what to do.
#pragma once

#include <stdexcept>

namespace volto::rig {

// Bad bytes: what() reads "file:line: what is wrong; what to do". The command line exits with 65.
struct InputError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace volto::rig
