// Exit statuses of `volto`, and the exception that carries one.
#pragma once

#include <stdexcept>
#include <string>

namespace volto::cli {

// The numbers of sysexits.h; scripts rely on them, do not change.
enum ExitStatus : int {
  kDone = 0,
  kFailed = 1,             // it was tried and did not work: a disk that is full, a folder that cannot be written
  kWrongUsage = 2,         // the command line itself
  kBadData = 65,           // an input was read and is not what it should be
  kNoInput = 66,           // an input is not there or cannot be opened
  kUnavailable = 69,       // a device, an endpoint or a service that others hold or that does not answer
  kBadConfiguration = 78,  // what Volto was told to be does not hold together
};

// what() is one line: what, where, and what to do. The verb's name is put in front of it when it is printed.
class CommandError : public std::runtime_error {
 public:
  CommandError(ExitStatus status, const std::string& line) : std::runtime_error(line), status_(status) {}
  ExitStatus status() const { return status_; }

 private:
  ExitStatus status_;
};

}  // namespace volto::cli
