// Topics: the first of the two frames of every message. Each level ends with '/', so that a subscription to a whole
// level never catches a longer name ("weights/anna/" does not match "weights/anna2/").
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "protocol/messages.h"

namespace volto::protocol {

inline constexpr std::size_t kMaxTopicBytes = 200;

// A level: 1 to 128 bytes of letters, digits, '.', '_', '-', or any byte of UTF-8 beyond ASCII; not "." nor "..".
bool isTopicName(std::string_view name);
// The nearest valid name: what may not be in a name becomes '_'; an empty name becomes "unnamed".
std::string topicNameFrom(std::string_view text);

// "weights/NAME/", ...; status has no name: "status/". Throws SetupError (usage) for a name that is none.
std::string makeTopic(MessageKind kind, std::string_view name = {});

struct Topic {
  MessageKind kind;
  std::string_view name;  // into the text that was parsed; empty for status/
};
// Nothing for a text that is not exactly one of the above.
std::optional<Topic> parseTopic(std::string_view text);

// The first level with its '/': "weights/".
std::string_view topicPrefix(MessageKind kind);
std::string_view kindName(MessageKind kind);  // "weights"

// Whether a subscription to `prefix` would receive `topic` (ZeroMQ: bytewise prefix).
inline bool subscriptionMatches(std::string_view prefix, std::string_view topic) { return topic.starts_with(prefix); }

}  // namespace volto::protocol
