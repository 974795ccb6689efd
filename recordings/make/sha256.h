// SHA-256 (FIPS 180-4), for the manifest.
#pragma once

#include <string>
#include <string_view>

namespace volto::recordings {

// Lower-case hexadecimal.
std::string sha256Hex(std::string_view bytes);

}  // namespace volto::recordings
