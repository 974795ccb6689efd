#include "tests/capture/fake/script.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <stdexcept>
#include <utility>

namespace volto::fake {

namespace {

// Words in "double quotes" may hold blanks.
std::vector<std::string> splitWords(std::string_view line) {
  std::vector<std::string> words;
  std::size_t i = 0;
  while (i < line.size() && line[i] != '#') {
    if (line[i] == ' ' || line[i] == '\t' || line[i] == '\r') {
      ++i;
      continue;
    }
    std::string word;
    if (line[i] == '"') {
      for (++i; i < line.size() && line[i] != '"'; ++i) word += line[i];
      ++i;
    } else {
      for (; i < line.size() && line[i] != ' ' && line[i] != '\t' && line[i] != '\r'; ++i) word += line[i];
    }
    words.push_back(std::move(word));
  }
  return words;
}

int parseNode(const std::string& word) {
  if (word == "none") return -1;
  if (!word.starts_with("video")) throw std::invalid_argument("'" + word + "' is no node; write videoN");
  return static_cast<int>(parseNumber(word.substr(5)));
}

CameraSpec parseCamera(const std::vector<std::string>& words) {
  CameraSpec camera;
  if (words.size() > 1) camera.card = words[1];
  for (std::size_t i = 2; i < words.size(); ++i) {
    if (words[i] == "metadata" || words[i] == "button") {
      (words[i] == "metadata" ? camera.metadata : camera.button) = true;
      continue;
    }
    if (i + 1 == words.size()) throw std::invalid_argument("'" + words[i] + "' wants a value");
    const std::string& value = words[i + 1];
    if (words[i] == "as")
      camera.number = parseNode(value);
    else if (words[i] == "bus")
      camera.bus = value;
    else if (words[i] == "by-id")
      camera.by_id = value;
    else if (words[i] == "driver")
      camera.driver = value;
    else
      throw std::invalid_argument("a camera has no '" + words[i] + "'");
    ++i;
  }
  return camera;
}

std::vector<FormatSpec> parseFormats(const std::vector<std::string>& words) {
  std::vector<FormatSpec> formats;
  std::string fourcc;
  for (std::size_t i = 1; i < words.size(); ++i) {
    if (words[i] == "/") {
      fourcc.clear();
    } else if (fourcc.empty()) {
      fourcc = words[i];
    } else {
      const std::string& word = words[i];
      const std::size_t x = word.find('x'), at = word.find('@');
      if (x == std::string::npos || at == std::string::npos) throw std::invalid_argument("'" + word + "' is no size");
      FormatSpec format{fourcc,
                        static_cast<int>(parseNumber(word.substr(0, x))),
                        static_cast<int>(parseNumber(word.substr(x + 1, at - x - 1))),
                        {}};
      for (std::size_t begin = at + 1; begin <= word.size();) {
        const std::size_t end = std::min(word.find(',', begin), word.size());
        format.rates_hz.push_back(parseNumber(word.substr(begin, end - begin)));
        begin = end + 1;
      }
      formats.push_back(std::move(format));
    }
  }
  return formats;
}

std::vector<FormatSpec> usualFormats() {
  return {{"YUYV", 640, 480, {30, 15}},
          {"YUYV", 320, 240, {30, 15}},
          {"YUYV", 1280, 720, {10, 5}},
          {"MJPG", 640, 480, {30, 15}},
          {"MJPG", 1280, 720, {30, 15}}};
}

}  // namespace

int errorNumber(std::string_view name) {
  constexpr std::array<std::pair<std::string_view, int>, 18> kErrors{{{"EACCES", EACCES},
                                                                      {"EAGAIN", EAGAIN},
                                                                      {"EBUSY", EBUSY},
                                                                      {"EFAULT", EFAULT},
                                                                      {"EINTR", EINTR},
                                                                      {"EINVAL", EINVAL},
                                                                      {"EIO", EIO},
                                                                      {"EMFILE", EMFILE},
                                                                      {"ENODEV", ENODEV},
                                                                      {"ENOENT", ENOENT},
                                                                      {"ENOMEM", ENOMEM},
                                                                      {"ENOSPC", ENOSPC},
                                                                      {"ENOTTY", ENOTTY},
                                                                      {"ENXIO", ENXIO},
                                                                      {"EPERM", EPERM},
                                                                      {"EPIPE", EPIPE},
                                                                      {"ERANGE", ERANGE},
                                                                      {"ETIMEDOUT", ETIMEDOUT}}};
  for (const auto& [text, number] : kErrors) {
    if (text == name) return number;
  }
  return 0;
}

double parseNumber(std::string_view text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size())
    throw std::invalid_argument("'" + std::string(text) + "' is no number");
  return value;
}

std::int64_t parseDuration(std::string_view text) {
  double scale = 1e9;
  if (text.ends_with("ms"))
    scale = 1e6, text.remove_suffix(2);
  else if (text.ends_with("us"))
    scale = 1e3, text.remove_suffix(2);
  else if (text.ends_with("s"))
    text.remove_suffix(1);
  else
    throw std::invalid_argument("'" + std::string(text) + "' is no time; write 2.5s or 2500ms");
  return static_cast<std::int64_t>(parseNumber(text) * scale);
}

Script parseScript(std::string_view text) {
  Script script;
  int line_number = 0;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::vector<std::string> words = splitWords(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
    ++line_number;
    if (words.empty()) continue;
    try {
      if (words[0] == "camera") {
        script.cameras.push_back(parseCamera(words));
        continue;
      }
      if (script.cameras.empty()) script.cameras.emplace_back();
      if (words[0] == "formats") {
        script.cameras.back().formats = parseFormats(words);
        continue;
      }
      Fault fault;
      fault.camera = script.cameras.size() - 1;
      fault.line = line_number;
      if (words[0] == "at") {
        if (words.size() < 3) throw std::invalid_argument("'at' wants a time and what happens then");
        if (words[1].ends_with("s"))
          fault.after_ns = parseDuration(words[1]);
        else
          fault.after_frames = parseNumber(words[1]);
        words.erase(words.begin(), words.begin() + 2);
      }
      fault.words = std::move(words);
      script.faults.push_back(std::move(fault));
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument("line " + std::to_string(line_number) + ": " + error.what());
    }
  }
  if (script.cameras.empty()) script.cameras.emplace_back();
  for (CameraSpec& camera : script.cameras) {
    if (camera.formats.empty()) camera.formats = usualFormats();
  }
  return script;
}

}  // namespace volto::fake
