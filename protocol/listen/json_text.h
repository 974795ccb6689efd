// Numbers and strings as JSON writes them.
#pragma once

#include <array>
#include <cstdio>
#include <string>
#include <string_view>

inline std::string number(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.7g", value);
  return text.data();
}

template <std::size_t N>
std::string list(const std::array<float, N>& values) {
  std::string out;
  for (const float v : values) out += (out.empty() ? "[" : ",") + number(v);
  return out + "]";
}

// A JSON string; names come from the publisher and may hold anything.
inline std::string jsonText(std::string_view text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
  }
  return out + "\"";
}
