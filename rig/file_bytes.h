// Whole files in and out: regular files only, sizes checked before allocating, written whole or not at all.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>

#include "rig/errors.h"

namespace volto::rig {

// The bytes of a regular file. Throws InputError when it is something else (a folder, a pipe, a device) or larger than
// max_bytes, std::system_error when it cannot be opened or read. Never blocks on a pipe. With LinksFollowed::no a symbolic
// link is not opened: for names that came from a file.
enum class LinksFollowed { no, yes };
std::string readFileBytes(const std::filesystem::path& path, std::size_t max_bytes,
                          LinksFollowed links = LinksFollowed::yes);

// Writes a temporary file beside `path`, flushes it to disk and renames it over `path`. On failure the temporary file
// is removed, what was at `path` stays, and std::system_error names the path.
void writeFileAtomically(const std::filesystem::path& path, std::string_view bytes);

}  // namespace volto::rig
