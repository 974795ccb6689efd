#include "tests/support/test_data.h"

#include <cstdlib>
#include <stdexcept>
#include <string>
#include <vector>

namespace volto::test {

namespace fs = std::filesystem;

fs::path sourceDir() { return VOLTO_SOURCE_DIR; }

std::optional<fs::path> dataDir() {
  const char* named = std::getenv("VOLTO_DATA");
  const fs::path path = named != nullptr && *named != '\0' ? fs::path(named) : sourceDir() / "../shared/data";
  std::error_code ignored;
  if (!fs::is_directory(path, ignored)) return std::nullopt;
  return path;
}

TemporaryDir::TemporaryDir() {
  std::string pattern = (fs::temp_directory_path() / "volto-test-XXXXXX").string();
  if (mkdtemp(pattern.data()) == nullptr) throw std::runtime_error("cannot make a temporary folder at " + pattern);
  path_ = pattern;
}

TemporaryDir::~TemporaryDir() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

}  // namespace volto::test
