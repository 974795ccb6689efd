// CURVE keys (CurveZMQ, Curve25519): what a publisher needs before it may be reached from another machine.
//
// Key file: two lines of text, "public XXXXX" and "secret XXXXX", each key 40 characters of Z85; mode 0600. Allow-list:
// one public key of a subscriber a line, '#' begins a comment.
#pragma once

#include <string>
#include <vector>

#include "protocol/errors.h"

namespace volto::protocol {

struct CurveKeys {
  std::string public_key;  // Z85, 40 characters
  std::string secret_key;
};

CurveKeys generateCurveKeys();

// Writes FILE (0600, must not exist) and FILE.pub (the public key alone, for others to have). Throws SetupError.
void writeCurveKeys(const std::string& path, const CurveKeys& keys);

// Throws SetupError (configuration): missing, readable by group or others, not a pair of keys, the test key of the
// ZeroMQ manual.
CurveKeys readCurveKeys(const std::string& path);
std::string readCurvePublicKey(const std::string& path);               // a FILE.pub
std::vector<std::string> readCurveAllowList(const std::string& path);  // sorted; at least one key

bool isCurveKey(const std::string& key);

}  // namespace volto::protocol
