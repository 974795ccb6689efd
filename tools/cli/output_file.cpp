#include "tools/cli/output_file.h"

#include <cerrno>
#include <cstring>
#include <system_error>
#include <unistd.h>
#include <utility>

#include "tools/cli/exit_status.h"

namespace volto::cli {

namespace fs = std::filesystem;

OutputFile::OutputFile(fs::path path, bool overwrite) : path_(std::move(path)) {
  if (path_ == "-") {
    file_ = stdout;
    return;
  }
  requireWritableTarget(path_);
  std::error_code ignored;
  if (fs::exists(path_, ignored) && !fs::is_regular_file(path_, ignored)) {
    file_ = std::fopen(path_.c_str(), "wb");  // a pipe or a device: nothing to replace, and never renamed over
    if (file_ == nullptr) fail("cannot be written");
    return;
  }
  if (!overwrite && fs::exists(path_, ignored)) {
    throw CommandError(kFailed, path_.string() + ": exists already; give --force to replace it");
  }
  part_path_ = path_.string() + "." + std::to_string(getpid()) + ".part";
  file_ = std::fopen(part_path_.c_str(), "wbx");
  if (file_ == nullptr) fail("cannot be written");
}

OutputFile::~OutputFile() {
  if (file_ != nullptr && file_ != stdout) std::fclose(file_);
  if (part_path_.empty()) return;
  std::error_code ignored;
  fs::remove(part_path_, ignored);
}

void OutputFile::write(std::string_view text) {
  if (std::fwrite(text.data(), 1, text.size(), file_) != text.size()) fail("cannot be written");
}

void OutputFile::commit() {
  if (part_path_.empty()) {
    if (std::fflush(file_) != 0) fail("cannot be written");
    return;
  }
  // On the disk before it takes the old file's name: after a power cut there is the old file or the new one, never half
  // of one.
  const bool written = std::fflush(file_) == 0 && fsync(fileno(file_)) == 0;
  const int error = errno;
  const bool closed = std::fclose(std::exchange(file_, nullptr)) == 0;
  if (!written) errno = error;
  if (!written || !closed) fail("cannot be written");
  if (std::rename(part_path_.c_str(), path_.c_str()) != 0) fail("cannot be put in place");
  part_path_.clear();
}

void OutputFile::fail(const char* doing) const {
  const std::string name = path_ == "-" ? "standard output" : path_.string();
  throw CommandError(kFailed, name + ": " + doing + ": " + std::strerror(errno));
}

void requireWritableTarget(const fs::path& path) {
  if (path.empty()) throw CommandError(kFailed, "the output file has no name; give one after -o");
  std::error_code ignored;
  if (fs::is_directory(path, ignored)) throw CommandError(kFailed, path.string() + ": is a folder; name a file in it");
  const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  if (!fs::is_directory(folder, ignored)) {
    throw CommandError(kFailed, path.string() + ": there is no folder " + folder.string() + "; make it first");
  }
  if (access(folder.c_str(), W_OK | X_OK) != 0) {
    throw CommandError(kFailed, path.string() + ": cannot write into " + folder.string() + ": " + std::strerror(errno));
  }
}

void requireReplaceable(const fs::path& path) {
  requireWritableTarget(path);
  std::error_code ignored;
  if (fs::exists(path, ignored) && !fs::is_regular_file(path, ignored)) {
    throw CommandError(kFailed, path.string() + ": is not a regular file; name one that may be replaced");
  }
}

void makeOutputFolder(const fs::path& path) {
  std::error_code error;
  fs::create_directory(path, error);
  if (error) throw CommandError(kFailed, path.string() + ": cannot be made a folder: " + error.message());
  if (!fs::is_directory(path, error)) {
    throw CommandError(kFailed, path.string() + ": is not a folder; name one that exists or can be made");
  }
  if (access(path.c_str(), W_OK | X_OK) != 0) {
    throw CommandError(kFailed, path.string() + ": cannot be written: " + std::strerror(errno));
  }
}

}  // namespace volto::cli
