#include "tests/capture/fake/fault_state.h"

#include <stdexcept>

#include "tests/capture/fake/script.h"

namespace volto::fake {

namespace {

// "p=0.05", "3", "forever" or nothing.
Dose parseDose(const std::vector<std::string>& words, std::size_t at) {
  if (at >= words.size() || words[at] == "forever") return {kForever, 0};
  if (words[at].starts_with("p=")) return {0, parseNumber(std::string_view(words[at]).substr(2))};
  return {static_cast<std::int64_t>(parseNumber(words[at])), 0};
}

const std::string& wordAt(const std::vector<std::string>& words, std::size_t at) {
  if (at >= words.size()) throw std::invalid_argument("'" + words[0] + "' wants a value");
  return words[at];
}

}  // namespace

int FaultState::takeError(const std::string& call) {
  const auto found = errors.find(call);
  if (found == errors.end() || found->second.left == 0) return 0;
  if (found->second.left != kForever) --found->second.left;
  return -found->second.error;
}

void FaultState::apply(const std::vector<std::string>& words, std::int64_t now_ns, bool& wrap_sequence) {
  const std::string& what = words[0];
  const auto value = [&]() -> const std::string& { return wordAt(words, 1); };
  if (words.size() > 1 && errorNumber(words[1]) != 0) {
    errors[what] = {errorNumber(words[1]), parseDose(words, 2).left};
  } else if (what == "ok") {
    const std::string keep = words.size() > 1 ? words[1] : "";
    if (keep.empty())
      *this = {};
    else
      errors.erase(keep);
  } else if ((what == "s_fmt" || what == "s_parm") && value() == "adjust") {
    const std::string& to = wordAt(words, 2);
    const std::size_t slash = to.find('/'), x = to.find('x');
    if (slash != std::string::npos) {
      interval_num = static_cast<int>(parseNumber(to.substr(0, slash)));
      interval_den = static_cast<int>(parseNumber(to.substr(slash + 1)));
    } else if (x != std::string::npos) {
      adjust_width = static_cast<int>(parseNumber(to.substr(0, x)));
      adjust_height = static_cast<int>(parseNumber(to.substr(x + 1)));
    } else {
      adjust_fourcc = to;
    }
  } else if (what == "enum" && value() == "only") {
    enum_only = wordAt(words, 2);
  } else if (what == "reqbufs" && value() == "grant") {
    grant = static_cast<int>(parseNumber(wordAt(words, 2)));
  } else if (what == "querybuf" && value() == "offset") {
    bad_offset = true;
  } else if (what == "dqbuf" && value() == "index") {
    wrong_index = static_cast<std::uint32_t>(parseNumber(wordAt(words, 2)));
    index_dose = parseDose(words, 3);
  } else if (what == "bytesused") {
    bytes_used = value();
    bytes_dose = parseDose(words, 2);
  } else if (what == "flag_error") {
    flag_error = parseDose(words, 1);
  } else if (what == "drop") {
    drop = parseDose(words, 1);
  } else if (what == "freeze") {
    if (value() == "streamoff")
      frozen_until_streamoff = true;
    else if (value() == "reopen")
      frozen_until_reopen = true;
    else
      frozen_until_ns = now_ns + parseDuration(value());
  } else if (what == "fatal") {
    fatal = true;
  } else if (what == "busy") {
    busy = true;
  } else if (what == "free") {
    busy = false;
  } else if (what == "ts") {
    time_mode = value();
    if (time_mode[0] == '+' || time_mode[0] == '-') {
      time_offset_ns = parseDuration(std::string_view(time_mode).substr(1)) * (time_mode[0] == '-' ? -1 : 1);
      time_mode = "offset";
    }
    time_dose = parseDose(words, 2);
  } else if (what == "seq") {
    wrap_sequence = value() == "wrap";
    sequence_stuck = value() == "stuck";
  } else if (what == "fps") {
    rate_hz = parseNumber(value());
  } else if (what == "mjpg") {
    jpeg = value();
    jpeg_dose = parseDose(words, 2);
  } else if (what == "eintr") {
    interrupt_every = static_cast<std::int64_t>(parseNumber(wordAt(words, 2)));
  } else if (what == "pollin") {
    spurious = parseDose(words, 2).left;
  } else {
    throw std::invalid_argument("there is no fault '" + what + "'");
  }
}

}  // namespace volto::fake
