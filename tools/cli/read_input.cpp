#include "tools/cli/read_input.h"

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>

#include "tools/cli/exit_status.h"

namespace volto::cli {

namespace fs = std::filesystem;

namespace {

struct Close {
  void operator()(std::FILE* file) const {
    if (file != stdin) std::fclose(file);
  }
};
using File = std::unique_ptr<std::FILE, Close>;

File open(const fs::path& path) {
  if (path == "-") return File(stdin);
  std::error_code ignored;
  if (fs::is_directory(path, ignored)) throw CommandError(kNoInput, path.string() + ": is a folder; name a file");
  File file(std::fopen(path.c_str(), "rb"));
  if (!file)
    throw CommandError(kNoInput, path.string() + ": cannot be opened: " + std::strerror(errno) + "; check the name");
  return file;
}

}  // namespace

void requireReadable(const fs::path& path, bool stdin_allowed) {
  if (path == "-") {
    if (!stdin_allowed) throw CommandError(kWrongUsage, "standard input is not read here; name a file");
    return;
  }
  open(path);
}

std::string readWhole(const fs::path& path, std::size_t limit) {
  const File file = open(path);
  std::string text;
  std::array<char, 65536> block;
  for (;;) {
    const std::size_t got = std::fread(block.data(), 1, block.size(), file.get());
    if (got == 0) break;
    if (text.size() + got > limit) {
      throw CommandError(
          kBadData, path.string() + ": is larger than " + std::to_string(limit >> 20) + " MiB; is it the right file?");
    }
    text.append(block.data(), got);
  }
  if (std::ferror(file.get()) != 0)
    throw CommandError(kNoInput, path.string() + ": cannot be read: " + std::strerror(errno));
  return text;
}

std::string readBeginning(const fs::path& path, std::size_t count) {
  const File file = open(path);
  std::string text(count, '\0');
  text.resize(std::fread(text.data(), 1, count, file.get()));
  if (std::ferror(file.get()) != 0)
    throw CommandError(kNoInput, path.string() + ": cannot be read: " + std::strerror(errno));
  return text;
}

void requireDifferent(const fs::path& in, const fs::path& out) {
  std::error_code ignored;
  if (in != "-" && fs::equivalent(in, out, ignored)) {
    throw CommandError(kWrongUsage, out.string() + ": is the input itself; write to another file");
  }
}

void requireDifferent(std::initializer_list<std::string> inputs, std::span<const std::string> outputs) {
  for (const std::string& out : outputs)
    for (const std::string& in : inputs)
      if (!in.empty() && !out.empty()) requireDifferent(in, out);
}

bool hasExtension(const fs::path& path, std::string_view wanted) {
  std::string extension = path.extension().string();
  for (char& c : extension) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return extension == wanted;
}

}  // namespace volto::cli
