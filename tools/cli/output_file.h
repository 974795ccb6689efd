// A file that appears whole or not at all.
#pragma once

#include <cstdio>
#include <filesystem>
#include <string>
#include <string_view>

namespace volto::cli {

// Writes to PATH.PID.part beside the target and renames it over the target in commit(); without commit() the destructor
// removes it and the target is as it was. "-" is standard output; it and what is no regular file (a pipe, a device) are
// written as the text comes. Thread-bound.
class OutputFile {
 public:
  // Throws CommandError (kFailed) when the file cannot be made. Refuses an existing target when `overwrite` is false.
  explicit OutputFile(std::filesystem::path path, bool overwrite = true);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  // Buffered; throws CommandError (kFailed) on a full disk and the like.
  void write(std::string_view text);
  void commit();

 private:
  [[noreturn]] void fail(const char* doing) const;

  std::filesystem::path path_;
  std::filesystem::path part_path_;  // empty for standard output
  std::FILE* file_ = nullptr;
};

// Throws CommandError (kFailed) unless PATH is a folder that can be written or can be made (its parent exists); makes
// it.
void makeOutputFolder(const std::filesystem::path& path);

// Throws CommandError (kFailed) when PATH's folder is not there or cannot be written, or PATH is a folder: found out
// before long work rather than after it.
void requireWritableTarget(const std::filesystem::path& path);
// Also refuses what is there and no regular file (/dev/null): a rename would replace it.
void requireReplaceable(const std::filesystem::path& path);

}  // namespace volto::cli
