#include "protocol/take_reader.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <limits>
#include <optional>
#include <sys/stat.h>
#include <unistd.h>
#include <vector>

#include "protocol/take_database.h"

namespace volto::protocol {
namespace {

// A damaged region is walked row by row; after so many numbers without a row the rest is taken for lost.
constexpr std::int64_t kMaxConsecutiveMisses = 100'000;

SetupError notATake(const std::string& path, const std::string& why) {
  return {SetupError::Kind::bad_data, path + ": not a take: " + why};
}

std::optional<std::int64_t> integerFrom(std::string_view text) {
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

// The first 100 bytes of an SQLite file, if it is one.
std::optional<std::array<unsigned char, 100>> sqliteHead(const std::string& path) {
  const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (fd < 0) return std::nullopt;
  std::array<unsigned char, 100> head{};
  struct stat info {};
  const bool good = ::fstat(fd, &info) == 0 && S_ISREG(info.st_mode) &&
                    ::read(fd, head.data(), head.size()) == static_cast<ssize_t>(head.size()) &&
                    std::memcmp(head.data(), "SQLite format 3", 16) == 0;
  ::close(fd);
  if (!good) return std::nullopt;
  return head;
}

std::int32_t bigEndian32(const unsigned char* p) {
  return static_cast<std::int32_t>(static_cast<std::uint32_t>(p[0]) << 24U | static_cast<std::uint32_t>(p[1]) << 16U |
                                   static_cast<std::uint32_t>(p[2]) << 8U | static_cast<std::uint32_t>(p[3]));
}

std::string uriOf(const std::string& path) {
  std::string uri = "file:";
  constexpr std::string_view kHex = "0123456789ABCDEF";
  for (const char c : std::filesystem::absolute(path).string()) {
    if (c == '?' || c == '#' || c == '%') {
      const auto byte = static_cast<unsigned char>(c);
      uri.append({'%', kHex[byte >> 4U], kHex[byte & 15U]});
    } else {
      uri += c;
    }
  }
  return uri + "?immutable=1";
}

}  // namespace

struct TakeReader::State {
  explicit State(const std::string& file) : path(file) {
    checkFile();
    open();
    try {
      checkSchema();
      quickCheck();
      readHeader();
      scan.emplace(database->get(), "SELECT id, t_ns, topic, payload, crc FROM messages WHERE id > ?1 ORDER BY id");
      probe.emplace(database->get(), "SELECT id, t_ns, topic, payload, crc FROM messages WHERE id = ?1");
    } catch (const DatabaseError& e) {
      throw notATake(path, e.what());
    }
    rewind();
  }

  void checkFile() const {
    std::error_code error;
    const auto status = std::filesystem::status(path, error);
    if (!std::filesystem::exists(status)) throw SetupError(SetupError::Kind::no_input, path + ": no such file");
    if (!std::filesystem::is_regular_file(status)) throw SetupError(SetupError::Kind::no_input, path + ": not a file");
    if (::access(path.c_str(), R_OK) != 0)
      throw SetupError(SetupError::Kind::no_input, path + ": " + std::strerror(errno));
    const auto head = sqliteHead(path);
    if (!head) throw notATake(path, "it does not begin like an SQLite file");
    if (const std::int32_t id = bigEndian32(head->data() + 68); id != kTakeApplicationId) {
      throw notATake(path, "an SQLite file of another program (application_id " + std::to_string(id) + ")");
    }
    if (const std::int32_t version = bigEndian32(head->data() + 60); version > kTakeVersion) {
      throw SetupError(SetupError::Kind::bad_data, path + ": made by a newer version of Volto (take version " +
                                                       std::to_string(version) + ", this program reads up to " +
                                                       std::to_string(kTakeVersion) + ")");
    } else if (version < 1) {
      throw notATake(path, "take version " + std::to_string(version));
    }
  }

  void open() {
    constexpr int kFlags = SQLITE_OPEN_READONLY | SQLITE_OPEN_NOMUTEX;
    try {
      openAs(path, kFlags, Mode::strict);
      return;
    } catch (const DatabaseError& e) {
      database.reset();
      if ((e.code & 0xFF) == SQLITE_CORRUPT) return openCut(kFlags);
      std::error_code ignored;
      const bool has_wal =
          std::filesystem::exists(path + "-wal", ignored) && std::filesystem::file_size(path + "-wal", ignored) > 0;
      const int code = e.code & 0xFF;
      if (has_wal || (code != SQLITE_CANTOPEN && code != SQLITE_READONLY)) throw notATake(path, e.what());
    }
    // A medium where not even the index of an empty journal can be made.
    try {
      openAs(uriOf(path), kFlags | SQLITE_OPEN_URI, Mode::strict);
    } catch (const DatabaseError& e) {
      throw notATake(path, e.what());
    }
  }

  // A file that is shorter than its first page says is refused by SQLite, unless it is told that somebody is at work on
  // its insides.
  void openCut(int flags) {
    file_damaged = true;
    try {
      openAs(path, flags, Mode::salvage);
    } catch (const DatabaseError& e) {
      throw notATake(path, e.what());
    }
  }

  enum class Mode { strict, salvage };

  // With everything switched off that a hostile file could make SQLite do.
  void openAs(const std::string& name, int flags, Mode mode) {
    database.emplace(name, flags);
    sqlite3* db = database->get();
    sqlite3_busy_timeout(db, 1000);
    sqlite3_db_config(db, SQLITE_DBCONFIG_DEFENSIVE, mode == Mode::strict ? 1 : 0, nullptr);
    sqlite3_db_config(db, SQLITE_DBCONFIG_WRITABLE_SCHEMA, mode == Mode::salvage ? 1 : 0, nullptr);
    sqlite3_db_config(db, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
    sqlite3_db_config(db, SQLITE_DBCONFIG_ENABLE_TRIGGER, 0, nullptr);
    sqlite3_db_config(db, SQLITE_DBCONFIG_ENABLE_VIEW, 0, nullptr);
    sqlite3_limit(db, SQLITE_LIMIT_LENGTH, static_cast<int>(kMaxInboundBytes + 4096));
    sqlite3_limit(db, SQLITE_LIMIT_SQL_LENGTH, 4096);
    sqlite3_limit(db, SQLITE_LIMIT_COLUMN, 16);
    sqlite3_limit(db, SQLITE_LIMIT_EXPR_DEPTH, 16);
    sqlite3_limit(db, SQLITE_LIMIT_COMPOUND_SELECT, 2);
    sqlite3_limit(db, SQLITE_LIMIT_ATTACHED, 0);
    sqlite3_limit(db, SQLITE_LIMIT_TRIGGER_DEPTH, 1);
    database->execute("PRAGMA cell_size_check=ON; PRAGMA mmap_size=0; PRAGMA query_only=ON");
    // Touches the file, so that what cannot be opened is found here.
    database->execute("SELECT count(*) FROM sqlite_schema");
  }

  void checkSchema() {
    Statement statement(database->get(), "SELECT type, name, sql FROM sqlite_schema ORDER BY name");
    int rows = 0;
    while (statement.step() == SQLITE_ROW) {
      const std::string_view name = statement.text(1);
      const std::string_view expected = name == "header"     ? kHeaderTableSql
                                        : name == "messages" ? kMessagesTableSql
                                                             : "";
      if (statement.text(0) != "table" || expected.empty() || statement.text(2) != expected) {
        throw notATake(path, "the " + std::string(statement.text(0)) + " '" + std::string(name.substr(0, 40)) +
                                 "' does not belong in one");
      }
      ++rows;
    }
    if (rows != 2) throw notATake(path, "its tables are missing");
  }

  void quickCheck() {
    try {
      Statement statement(database->get(), "PRAGMA quick_check(1)");
      file_damaged = statement.step() != SQLITE_ROW || statement.text(0) != "ok" || file_damaged;
    } catch (const DatabaseError&) {
      file_damaged = true;
    }
  }

  void readHeader() {
    Statement statement(database->get(), "SELECT key, value, crc FROM header");
    int code = SQLITE_ROW;
    while ((code = statement.step()) == SQLITE_ROW) {
      const std::string key(statement.text(0));
      const std::string value(statement.text(1));
      if (statement.integer(2) != static_cast<std::int64_t>(headerCrc(key, value))) {
        file_damaged = true;
        continue;
      }
      if (key == "name") header.name = value;
      if (key == "source") header.source = value;
      if (key == "layout") header.layout = value;
      if (key == "actor") header.actor = value;
      if (key == "note") header.note = value;
      if (key == "program") header.program = value;
      if (key == "start_realtime_ns") header.start_realtime_ns = integerFrom(value).value_or(0);
      if (key == "start_monotonic_ns") header.start_monotonic_ns = integerFrom(value).value_or(0);
      if (key == "finished") finished = value == "1";
      if (key == "messages") expected_rows = integerFrom(value);
    }
    if (code != SQLITE_DONE) file_damaged = true;
  }

  void rewind() {
    scan->reset();
    probe->reset();
    last_id = cursor = bad_since_good = 0;
    counters = {};
    counters.file_damaged = file_damaged;
    at_end = false;
    startScan();
  }

  void startScan() {
    scan->reset();
    scan->bind(1, cursor);
  }

  // A row that `statement` stands on: true when it may be handed out. Else it is counted.
  bool accept(Statement& statement, TakeRow& row) {
    const std::int64_t id = statement.integer(0);
    if (id <= last_id) {
      countBad(id, "its number does not rise");
      return false;
    }
    const std::int64_t t_ns = statement.integer(1);
    const std::string_view row_topic = statement.text(2);
    const Bytes bytes = statement.blob(3);
    if (!statement.isType(3, SQLITE_BLOB) ||
        statement.integer(4) != static_cast<std::int64_t>(rowCrc(id, t_ns, row_topic, bytes))) {
      // Nothing in it can be trusted, its number neither.
      countBad(id, "the checksum does not match");
      return false;
    }
    countLost(id - last_id - 1);
    last_id = cursor = id;
    const std::optional<Topic> parsed = parseTopic(row_topic);
    if (!parsed) {
      ++counters.unknown_topics;
      return false;
    }
    aligned.resize((bytes.size() + 7) / 8);
    if (!bytes.empty()) std::memcpy(aligned.data(), bytes.data(), bytes.size());
    const Bytes payload(reinterpret_cast<const std::byte*>(aligned.data()), bytes.size());
    Result verdict = inspector.check(payload, row.stamp);
    if (verdict.ok() && messageKind(payload) != parsed->kind)
      verdict = Result::bad("the message is not of its topic's kind");
    if (!verdict.ok()) {
      countBad(id, verdict.problem);
      bad_since_good = 0;  // its number is known to be right
      return false;
    }
    topic.assign(row_topic);
    row.id = static_cast<std::uint64_t>(id);
    row.t_ns = t_ns;
    row.topic = topic;
    row.kind = parsed->kind;
    row.name = parseTopic(topic)->name;
    row.payload = payload;
    ++counters.delivered;
    return true;
  }

  void countBad(std::int64_t id, const std::string& why) {
    ++counters.bad_rows;
    ++bad_since_good;
    // Where to go on if the next page cannot be read; a number that was hit itself may be anything.
    if (id > cursor && id - cursor <= 1000) cursor = id;
    if (counters.first_problem.empty()) counters.first_problem = path + ": row " + std::to_string(id) + ": " + why;
  }

  // Numbers missing since the last good row: some of them are the bad rows, which are there.
  void countLost(std::int64_t missing) {
    counters.lost_rows += static_cast<std::uint64_t>(std::max<std::int64_t>(missing - bad_since_good, 0));
    bad_since_good = 0;
  }

  bool next(TakeRow& row) {
    while (!at_end) {
      const int code = scan->step();
      if (code == SQLITE_ROW) {
        if (accept(*scan, row)) return true;
        continue;
      }
      if (code == SQLITE_DONE) {
        finishCounting();
        break;
      }
      file_damaged = counters.file_damaged = true;
      if (counters.first_problem.empty())
        counters.first_problem = path + ": after row " + std::to_string(cursor) + ": " + database->message();
      switch (findNext(row)) {
        case Found::row:
          startScan();
          return true;
        case Found::bad_row:
          startScan();
          break;
        case Found::nothing:
          finishCounting();
          break;
      }
    }
    return false;
  }

  enum class Found { row, bad_row, nothing };

  // Beyond a page that cannot be read: asks for each number by itself.
  Found findNext(TakeRow& row) {
    const std::int64_t last =
        std::min(expected_rows.value_or(std::numeric_limits<std::int64_t>::max()), cursor + possibleRows());
    for (std::int64_t id = cursor + 1; id <= last; ++id) {
      probe->reset();
      probe->bind(1, id);
      if (probe->step() != SQLITE_ROW) continue;
      const bool good = accept(*probe, row);
      probe->reset();
      cursor = id;
      return good ? Found::row : Found::bad_row;
    }
    return Found::nothing;
  }

  // No more than fit into a file of this size.
  std::int64_t possibleRows() const {
    constexpr std::int64_t kLeastRowBytes = 64;
    std::int64_t bytes = 0;
    for (const char* suffix : {"", "-wal"}) {
      std::error_code error;
      const auto size = std::filesystem::file_size(path + suffix, error);
      if (!error) bytes += static_cast<std::int64_t>(size);
    }
    return std::min(bytes / kLeastRowBytes + 1, kMaxConsecutiveMisses);
  }

  void finishCounting() {
    at_end = true;
    scan->reset();
    if (expected_rows && *expected_rows > last_id) countLost(*expected_rows - last_id);
  }

  std::string path;
  std::optional<Database> database;
  std::optional<Statement> scan, probe;
  TakeHeader header;
  bool finished = false, file_damaged = false, at_end = false;
  std::optional<std::int64_t> expected_rows;
  std::int64_t last_id = 0;         // of the last row that could be trusted
  std::int64_t cursor = 0;          // where a new scan begins
  std::int64_t bad_since_good = 0;  // rows
  TakeReaderCounters counters;
  Inspector inspector;
  std::vector<std::uint64_t> aligned;
  std::string topic;
};

TakeReader::TakeReader(const std::string& path) : state_(std::make_unique<State>(path)) {}
TakeReader::~TakeReader() = default;
TakeReader::TakeReader(TakeReader&&) noexcept = default;
TakeReader& TakeReader::operator=(TakeReader&&) noexcept = default;

const TakeHeader& TakeReader::header() const { return state_->header; }
bool TakeReader::finished() const { return state_->finished; }
const TakeReaderCounters& TakeReader::counters() const { return state_->counters; }
bool TakeReader::next(TakeRow& row) { return state_->next(row); }
void TakeReader::rewind() { state_->rewind(); }

bool TakeReader::next(LandmarkMessage& out) {
  TakeRow row;
  while (next(row)) {
    if (row.kind == MessageKind::landmarks && decode(row.payload, out).ok()) return true;
  }
  return false;
}

bool TakeReader::next(MaskMessage& out) {
  TakeRow row;
  while (next(row)) {
    if (row.kind == MessageKind::mask && decode(row.payload, out).ok()) return true;
  }
  return false;
}

TakeSummary summarizeTake(const std::string& path) {
  TakeReader reader(path);
  TakeSummary summary;
  summary.header = reader.header();
  summary.finished = reader.finished();
  struct Last {
    Stamp stamp;
  };
  std::map<std::string, Last> last;
  TakeRow row;
  while (reader.next(row)) {
    const std::string topic(row.topic);
    TakeSummary::Stream& stream = summary.streams[topic];
    const auto before = last.find(topic);
    if (before == last.end()) {
      stream.kind = row.kind;
      stream.first_ns = row.t_ns;
    } else {
      const Stamp& then = before->second.stamp;
      const bool same_epoch = then.epoch == row.stamp.epoch;
      if (same_epoch && row.stamp.seq > then.seq) stream.lost += row.stamp.seq - then.seq - 1;
      if (same_epoch && row.stamp.capture_seq > then.capture_seq)
        stream.capture_lost += row.stamp.capture_seq - then.capture_seq - 1;
    }
    last[topic].stamp = row.stamp;
    ++stream.messages;
    stream.bytes += row.payload.size();
    stream.last_ns = row.t_ns;
  }
  summary.counters = reader.counters();
  return summary;
}

bool looksLikeTake(const std::string& path) {
  const auto head = sqliteHead(path);
  return head && bigEndian32(head->data() + 68) == kTakeApplicationId;
}

TakeReaderCounters recoverTake(const std::string& in, const std::string& out, bool force) {
  TakeReader reader(in);
  std::error_code ignored;
  if (std::filesystem::equivalent(in, out, ignored)) {
    throw SetupError(SetupError::Kind::failed, out + ": is the damaged take itself; choose another name");
  }
  TakeHeader header = reader.header();
  TakeWriterOptions options;
  options.force = force;
  options.reproducible = true;  // whole or not at all, and nothing dropped
  TakeWriter writer(out, header, options);
  TakeRow row;
  while (reader.next(row)) {
    if (Result r = writer.appendChecked(row.topic, row.stamp, row.payload); !r)
      throw SetupError(SetupError::Kind::failed, r.problem);
  }
  if (Result r = writer.finish(); !r) throw SetupError(SetupError::Kind::failed, r.problem);
  return reader.counters();
}

}  // namespace volto::protocol
