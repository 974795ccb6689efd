#pragma once

#include <cstddef>
#include <filesystem>
#include <span>

namespace volto::picture {

// Written whole or not at all: into a temporary file in the same folder, renamed at the end. Throws std::system_error
// naming `path`.
void writeWholeFile(const std::filesystem::path& path, std::span<const std::byte> bytes);

}  // namespace volto::picture
