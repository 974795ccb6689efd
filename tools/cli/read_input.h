// Opening what the command line names.
#pragma once

#include <cstddef>
#include <filesystem>
#include <initializer_list>
#include <span>
#include <string>
#include <string_view>

namespace volto::cli {

// Throws CommandError (kNoInput) unless PATH can be opened for reading and is no folder. "-" is accepted where
// `stdin_allowed`.
void requireReadable(const std::filesystem::path& path, bool stdin_allowed = false);

// The whole file, at most `limit` bytes; beyond that CommandError (kBadData). "-" is standard input.
std::string readWhole(const std::filesystem::path& path, std::size_t limit);

// At most the first `count` bytes of a file.
std::string readBeginning(const std::filesystem::path& path, std::size_t count);

// Throws CommandError (kWrongUsage) when OUT is the same file as IN: the input would be lost.
void requireDifferent(const std::filesystem::path& in, const std::filesystem::path& out);
// Each output from each input; an empty path is none.
void requireDifferent(std::initializer_list<std::string> inputs, std::span<const std::string> outputs);

// By the end of the name, upper or lower case: ".glb".
bool hasExtension(const std::filesystem::path& path, std::string_view wanted);

}  // namespace volto::cli
