// SHA-256 (FIPS 180-4): whether a file is the one that a manifest names.
#pragma once

#include <string>
#include <string_view>

namespace volto::capture {

// Lower-case hexadecimal.
std::string sha256Hex(std::string_view bytes);

}  // namespace volto::capture
