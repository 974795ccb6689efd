// FaultState: what is wrong with a fake camera at the moment, as the script's lines have set it so far.
#pragma once

#include <cstdint>
#include <limits>
#include <map>
#include <string>
#include <vector>

namespace volto::fake {

inline constexpr std::int64_t kForever = std::numeric_limits<std::int64_t>::max();

// A fault that lasts for some calls or pictures, or happens with a probability.
struct Dose {
  std::int64_t left = 0;
  double probability = 0;
  bool active() const { return left > 0 || probability > 0; }
};

struct FaultState {
  struct Error {
    int error = 0;
    std::int64_t left = 0;
  };
  std::map<std::string, Error> errors;  // by call: "open", "s_fmt", "dqbuf", ...

  int adjust_width = -1, adjust_height = -1;  // S_FMT answers this size
  std::string adjust_fourcc;                  // ... or this format
  int interval_num = 0, interval_den = 0;     // S_PARM answers this
  std::string enum_only;                      // ENUM_FMT knows only this
  int grant = -1;                             // REQBUFS gives so many
  bool bad_offset = false;                    // QUERYBUF's offset leads nowhere
  std::uint32_t wrong_index = 0;              // DQBUF gives a buffer that is none
  Dose index_dose;
  std::string bytes_used;  // "0", "short", "length+1"
  Dose bytes_dose;
  Dose flag_error, drop;
  std::int64_t frozen_until_ns = 0;
  bool frozen_until_streamoff = false, frozen_until_reopen = false;
  bool fatal = false;     // the queue is in error until STREAMOFF
  bool busy = false;      // another program streams
  std::string time_mode;  // "", "0", "realtime", "offset", "stuck"
  std::int64_t time_offset_ns = 0;
  Dose time_dose;
  bool sequence_stuck = false;
  double rate_hz = 0;  // what is really delivered; 0: what was agreed
  std::string jpeg = "ok";
  Dose jpeg_dose;
  std::int64_t interrupt_every = 0;
  std::int64_t spurious = 0;  // wake-ups of poll for nothing

  // One line of the script, without its "at", for faults of the device itself; "unplug" and "replug" are World's.
  // Throws std::invalid_argument. `wrap_sequence` is set by "seq wrap".
  void apply(const std::vector<std::string>& words, std::int64_t now_ns, bool& wrap_sequence);

  // The error that this call is to fail with (negative), counted down; 0: none.
  int takeError(const std::string& call);
};

}  // namespace volto::fake
