#include "protocol/curve.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <fstream>
#include <sstream>
#include <string_view>
#include <sys/stat.h>
#include <unistd.h>

#include <zmq.h>

namespace volto::protocol {
namespace {

constexpr std::size_t kKeyChars = 40;
constexpr std::size_t kMaxKeyFileBytes = 1U << 20U;

// Printed in the manual of ZeroMQ, so known to everybody.
constexpr std::array<std::string_view, 4> kPublishedKeys{
    "rq:rM>}U?@Lns47E1%kR.o@n%FcmmsL/@{H8]yf7", "JTKVSB%%)wK0E.X)V>+}o?pNmC{O&4W4b!Ni{Lh6",
    "Yne@$w-vo<fVvi]a<NY6T1ed:M$fCG*[IaLV{hID", "D:)Q[IlAW!ahhC2ac:9*A}h:p?([4%wOTJ%JR%cs"};

SetupError bad(const std::string& path, const std::string& why) {
  return {SetupError::Kind::configuration, path + ": " + why};
}

std::string readSmallFile(const std::string& path, bool secret) {
  const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (fd < 0) throw bad(path, std::string("cannot be read: ") + std::strerror(errno));
  struct stat info {};
  std::string text;
  std::string problem;
  if (::fstat(fd, &info) != 0 || !S_ISREG(info.st_mode)) {
    problem = "not a file";
  } else if (secret && (info.st_mode & 077U) != 0) {
    problem = "other users may read this secret key: chmod 600 it (and make a new one if they did)";
  } else if (info.st_size > static_cast<off_t>(kMaxKeyFileBytes)) {
    problem = "too large to be a file of keys";
  } else {
    text.resize(static_cast<std::size_t>(info.st_size));
    const ssize_t n = ::read(fd, text.data(), text.size());
    text.resize(n > 0 ? static_cast<std::size_t>(n) : 0);
  }
  ::close(fd);
  if (!problem.empty()) throw bad(path, problem);
  return text;
}

// Words of each line, comments and empty lines left out, with the line's number.
std::vector<std::pair<int, std::vector<std::string>>> linesOf(const std::string& text) {
  std::vector<std::pair<int, std::vector<std::string>>> lines;
  std::istringstream in(text);
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    std::istringstream words(line);
    std::vector<std::string> found;
    // '#' is a letter of Z85 too, so only at the beginning of a line does it make a comment.
    for (std::string word; words >> word && !(found.empty() && word.front() == '#' && word.size() != kKeyChars);)
      found.push_back(word);
    if (!found.empty()) lines.emplace_back(number, found);
  }
  return lines;
}

void writeNew(const std::string& path, const std::string& text, mode_t mode) {
  const int fd = ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, mode);
  if (fd < 0) throw SetupError(SetupError::Kind::failed, path + ": cannot be made: " + std::strerror(errno));
  const bool written = ::write(fd, text.data(), text.size()) == static_cast<ssize_t>(text.size());
  if (::close(fd) != 0 || !written) {
    ::unlink(path.c_str());
    throw SetupError(SetupError::Kind::failed, path + ": cannot be written");
  }
}

}  // namespace

bool isCurveKey(const std::string& key) {
  std::array<std::uint8_t, 32> raw{};
  return key.size() == kKeyChars && zmq_z85_decode(raw.data(), key.c_str()) != nullptr;
}

CurveKeys generateCurveKeys() {
  std::array<char, kKeyChars + 1> public_key{}, secret_key{};
  if (zmq_curve_keypair(public_key.data(), secret_key.data()) != 0) {
    throw SetupError(SetupError::Kind::failed, "this ZeroMQ library was built without CURVE");
  }
  return {public_key.data(), secret_key.data()};
}

void writeCurveKeys(const std::string& path, const CurveKeys& keys) {
  writeNew(path, "public " + keys.public_key + "\nsecret " + keys.secret_key + "\n", 0600);
  writeNew(path + ".pub", keys.public_key + "\n", 0644);
}

CurveKeys readCurveKeys(const std::string& path) {
  CurveKeys keys;
  for (const auto& [number, words] : linesOf(readSmallFile(path, true))) {
    if (words.size() != 2 || (words[0] != "public" && words[0] != "secret") || !isCurveKey(words[1])) {
      throw bad(path + ":" + std::to_string(number), "expected 'public KEY' or 'secret KEY', a KEY of 40 characters");
    }
    (words[0] == "public" ? keys.public_key : keys.secret_key) = words[1];
  }
  if (keys.public_key.empty() || keys.secret_key.empty()) throw bad(path, "the public or the secret key is missing");
  std::array<char, kKeyChars + 1> derived{};
  if (zmq_curve_public(derived.data(), keys.secret_key.c_str()) != 0 || keys.public_key != derived.data()) {
    throw bad(path, "the public key does not belong to the secret key");
  }
  for (const std::string_view published : kPublishedKeys) {
    if (keys.secret_key == published || keys.public_key == published) {
      throw bad(path, "this is the test key from the manual of ZeroMQ; make one of your own");
    }
  }
  return keys;
}

std::string readCurvePublicKey(const std::string& path) {
  const auto lines = linesOf(readSmallFile(path, false));
  if (lines.size() != 1 || lines[0].second.size() != 1 || !isCurveKey(lines[0].second[0])) {
    throw bad(path, "expected one public key of 40 characters");
  }
  return lines[0].second[0];
}

std::vector<std::string> readCurveAllowList(const std::string& path) {
  std::vector<std::string> keys;
  for (const auto& [number, words] : linesOf(readSmallFile(path, false))) {
    if (!isCurveKey(words[0])) throw bad(path + ":" + std::to_string(number), "expected a public key of 40 characters");
    keys.push_back(words[0]);
  }
  if (keys.empty()) throw bad(path, "lists no key, so nobody could connect");
  std::sort(keys.begin(), keys.end());
  return keys;
}

}  // namespace volto::protocol
