#include "protocol/topics.h"

#include <algorithm>
#include <array>

#include "protocol/errors.h"

namespace volto::protocol {
namespace {

constexpr std::array<std::string_view, kMessageKindCount> kPrefixes{"landmarks/", "mask/",      "weights/",
                                                                    "mesh/",      "character/", "status/"};

bool isNameByte(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' || c == '_' ||
         c == '-' || static_cast<unsigned char>(c) >= 0x80;
}

}  // namespace

bool isTopicName(std::string_view name) {
  return !name.empty() && name.size() <= kMaxNameBytes && name != "." && name != ".." &&
         std::all_of(name.begin(), name.end(), isNameByte);
}

std::string topicNameFrom(std::string_view text) {
  std::string name(text.substr(0, kMaxNameBytes));
  for (char& c : name) {
    if (!isNameByte(c)) c = '_';
  }
  return isTopicName(name) ? name : "unnamed";
}

std::string_view topicPrefix(MessageKind kind) { return kPrefixes[static_cast<std::size_t>(kind)]; }

std::string_view kindName(MessageKind kind) {
  const std::string_view prefix = topicPrefix(kind);
  return prefix.substr(0, prefix.size() - 1);
}

std::string makeTopic(MessageKind kind, std::string_view name) {
  std::string topic(topicPrefix(kind));
  if (kind == MessageKind::status) return topic;
  if (!isTopicName(name)) {
    throw SetupError(SetupError::Kind::usage, "'" + std::string(name) + "' cannot be a name in " + topic +
                                                  "NAME/: use 1 to 128 letters, digits, '.', '_' or '-'");
  }
  return topic.append(name).append("/");
}

std::optional<Topic> parseTopic(std::string_view text) {
  for (std::size_t i = 0; i < kPrefixes.size(); ++i) {
    if (!text.starts_with(kPrefixes[i])) continue;
    const auto kind = static_cast<MessageKind>(i);
    std::string_view name = text.substr(kPrefixes[i].size());
    if (kind == MessageKind::status) return name.empty() ? std::optional<Topic>({kind, {}}) : std::nullopt;
    if (!name.ends_with('/')) return std::nullopt;
    name.remove_suffix(1);
    if (!isTopicName(name)) return std::nullopt;
    return Topic{kind, name};
  }
  return std::nullopt;
}

}  // namespace volto::protocol
