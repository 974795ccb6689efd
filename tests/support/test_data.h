// Where tests find their data.
#pragma once

#include <filesystem>
#include <optional>

namespace volto::test {

// The repository's own root, for data that is shipped with it.
std::filesystem::path sourceDir();

// The folder of public test material named by VOLTO_DATA (default: ../shared/data beside the repository), or nothing where it is absent.
std::optional<std::filesystem::path> dataDir();

// A fresh empty folder for one test, removed with the object.
class TemporaryDir {
 public:
  TemporaryDir();
  ~TemporaryDir();
  TemporaryDir(const TemporaryDir&) = delete;
  TemporaryDir& operator=(const TemporaryDir&) = delete;
  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path operator/(const std::filesystem::path& name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

}  // namespace volto::test

// First line of a test that needs the public test material.
#define VOLTO_REQUIRE_DATA(variable)                                                       \
  const auto variable##_found = ::volto::test::dataDir();                                  \
  if (!variable##_found) GTEST_SKIP() << "SKIPPED: no test data; set VOLTO_DATA to it";    \
  const std::filesystem::path& variable = *variable##_found
