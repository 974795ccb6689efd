#include "protocol/take_writer.h"

#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <map>
#include <mutex>
#include <optional>
#include <random>
#include <thread>
#include <unistd.h>
#include <vector>

#include "protocol/clock.h"
#include "protocol/take_database.h"

namespace volto::protocol {
namespace {

// Messages on their way to the disk, in memory that is used again and again.
struct Batch {
  struct Entry {
    std::int64_t t_ns;
    std::uint32_t topic;  // index
    std::size_t offset, size;
  };
  std::vector<Entry> entries;
  std::vector<std::byte> bytes;

  void clear() {
    entries.clear();
    bytes.clear();
  }
};

void removeSideFiles(const std::string& path) {
  // A journal of a file that was there before would be played into the new one.
  for (const char* suffix : {"-wal", "-shm", "-journal"}) ::unlink((path + suffix).c_str());
}

// An empty file that was not there before, or an error that names it.
void claim(const std::string& path, bool force) {
  if (force && ::unlink(path.c_str()) != 0 && errno != ENOENT) {
    throw SetupError(SetupError::Kind::failed, path + ": cannot be overwritten: " + std::strerror(errno));
  }
  const int fd = ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644);
  if (fd < 0) {
    if (errno == EEXIST)
      throw SetupError(SetupError::Kind::failed, path + ": exists; choose another name, or --force to overwrite it");
    throw SetupError(SetupError::Kind::failed, path + ": cannot be made: " + std::strerror(errno));
  }
  ::close(fd);
  removeSideFiles(path);
}

}  // namespace

struct TakeWriter::State {
  State(const std::string& file, const TakeHeader& take_header, const TakeWriterOptions& how)
      : path(file), options(how), header(take_header) {
    target = options.reproducible ? path + ".part" : path;
    if (options.reproducible) {
      if (!options.force && std::filesystem::exists(path)) {
        throw SetupError(SetupError::Kind::failed, path + ": exists; choose another name, or --force to overwrite it");
      }
    } else if (header.start_realtime_ns == 0) {
      header.start_realtime_ns = realtimeNs();
      header.start_monotonic_ns = monotonicNs();
    }
    claim(target, options.force || options.reproducible);
    try {
      create();
    } catch (const DatabaseError& e) {
      database.reset();
      ::unlink(target.c_str());
      removeSideFiles(target);
      throw SetupError(SetupError::Kind::failed, target + ": " + e.what());
    }
    epoch =
        options.reproducible ? 1 : (static_cast<std::uint64_t>(std::random_device{}()) << 32U | std::random_device{}());
    if (!options.reproducible) thread = std::thread([this] { run(); });
  }

  void create() {
    database.emplace(target, SQLITE_OPEN_READWRITE | SQLITE_OPEN_NOMUTEX);
    sqlite3_busy_timeout(database->get(), 1000);
    // Synchronous FULL: each commit is flushed, so that a power cut costs what a kill costs. Reproducible files are
    // renamed when whole.
    const std::string pragmas =
        std::string("PRAGMA page_size=4096; PRAGMA encoding='UTF-8'; PRAGMA trusted_schema=OFF; ") +
        (options.reproducible ? "PRAGMA journal_mode=OFF; PRAGMA synchronous=OFF; PRAGMA locking_mode=EXCLUSIVE;"
                              : "PRAGMA synchronous=FULL;");
    database->execute(pragmas.c_str());
    database->execute("BEGIN");
    database->execute(("PRAGMA application_id=" + std::to_string(kTakeApplicationId)).c_str());
    database->execute(("PRAGMA user_version=" + std::to_string(kTakeVersion)).c_str());
    database->execute(kHeaderTableSql);
    database->execute(kMessagesTableSql);
    put("name", header.name);
    put("source", header.source);
    put("layout", header.layout);
    put("actor", header.actor);
    put("note", header.note);
    put("program", header.program);
    put("start_realtime_ns", std::to_string(header.start_realtime_ns));
    put("start_monotonic_ns", std::to_string(header.start_monotonic_ns));
    if (!options.reproducible) {
      database->execute("COMMIT");
      // Only now: from its first moment the file is a whole, empty take.
      database->execute("PRAGMA journal_mode=WAL");
    }
    insert.emplace(database->get(), "INSERT INTO messages (id, t_ns, topic, payload, crc) VALUES (?1, ?2, ?3, ?4, ?5)");
  }

  void put(std::string_view key, std::string_view value) {
    Statement statement(database->get(), "INSERT INTO header (key, value, crc) VALUES (?1, ?2, ?3)");
    statement.bind(1, key);
    statement.bind(2, value);
    statement.bind(3, static_cast<std::int64_t>(headerCrc(key, value)));
    if (const int code = statement.step(); code != SQLITE_DONE) throw DatabaseError(code, database->message());
  }

  void insertRow(std::int64_t t_ns, std::string_view topic, Bytes payload) {
    const std::int64_t id = last_id + 1;
    insert->bind(1, id);
    insert->bind(2, t_ns);
    insert->bind(3, topic);
    insert->bind(4, payload);
    insert->bind(5, static_cast<std::int64_t>(rowCrc(id, t_ns, topic, payload)));
    const int code = insert->step();
    const std::string problem = code == SQLITE_DONE ? std::string() : database->message();
    insert->reset();
    if (code != SQLITE_DONE) throw DatabaseError(code, problem);
    last_id = id;
  }

  // Called with the mutex held.
  void enqueue(std::int64_t t_ns, std::string_view topic, Bytes payload) {
    if (finished || !counters.error.empty()) {
      ++counters.dropped;
      return;
    }
    if (options.reproducible) {
      try {
        insertRow(t_ns, topic, payload);
        ++counters.appended;
      } catch (const DatabaseError& e) {
        counters.error = path + ": " + e.what();
        ++counters.dropped;
      }
      return;
    }
    if (filling.bytes.size() + payload.size() > options.queue_bytes) {
      ++counters.dropped;
      return;
    }
    auto known = topic_index.find(topic);
    if (known == topic_index.end()) {
      known = topic_index.emplace(std::string(topic), static_cast<std::uint32_t>(topics.size())).first;
      topics.push_back(&known->first);
    }
    filling.entries.push_back({t_ns, known->second, filling.bytes.size(), payload.size()});
    filling.bytes.insert(filling.bytes.end(), payload.begin(), payload.end());
    ++counters.appended;
    if (filling.bytes.size() >= options.commit_bytes) wake.notify_one();
  }

  void run() {
    std::unique_lock lock(mutex);
    while (true) {
      wake.wait_for(lock, std::chrono::milliseconds(options.commit_interval_ms),
                    [this] { return stopping || filling.bytes.size() >= options.commit_bytes; });
      if (filling.entries.empty()) {
        if (stopping) return;
        continue;
      }
      std::swap(filling, writing);
      const std::vector<const std::string*> names = topics;
      lock.unlock();
      const std::string problem = commit(names);
      lock.lock();
      if (problem.empty()) {
        counters.committed += writing.entries.size();
      } else {
        counters.dropped += writing.entries.size() + filling.entries.size();
        counters.appended -= writing.entries.size() + filling.entries.size();
        counters.error = path + ": " + problem + "; the recording ended here";
        filling.clear();
      }
      writing.clear();
      if (!problem.empty()) return;
    }
  }

  // All of `writing` in one transaction, or none of it: then what went wrong.
  std::string commit(const std::vector<const std::string*>& names) {
    const std::int64_t id_before = last_id;
    try {
      database->execute("BEGIN");
      for (const Batch::Entry& e : writing.entries) {
        insertRow(e.t_ns, *names[e.topic], Bytes(writing.bytes).subspan(e.offset, e.size));
      }
      database->execute("COMMIT");
      return {};
    } catch (const DatabaseError& e) {
      const std::string problem = e.what();
      last_id = id_before;
      if (sqlite3_get_autocommit(database->get()) == 0)
        sqlite3_exec(database->get(), "ROLLBACK", nullptr, nullptr, nullptr);
      return problem;
    }
  }

  Result finish() {
    {
      const std::lock_guard lock(mutex);
      if (finished) return verdict();
      finished = stopping = true;
      wake.notify_one();
    }
    if (thread.joinable()) thread.join();
    const std::lock_guard lock(mutex);
    try {
      if (counters.error.empty()) {
        if (!options.reproducible) database->execute("BEGIN");
        put("messages", std::to_string(last_id));
        put("finished", "1");
        database->execute("COMMIT");
      }
    } catch (const DatabaseError& e) {
      counters.error = path + ": " + e.what();
      if (sqlite3_get_autocommit(database->get()) == 0)
        sqlite3_exec(database->get(), "ROLLBACK", nullptr, nullptr, nullptr);
    }
    insert.reset();
    if (options.reproducible) {
      database.reset();
      if (counters.error.empty() && ::rename(target.c_str(), path.c_str()) != 0) {
        counters.error = path + ": cannot be written: " + std::strerror(errno);
      }
      if (counters.error.empty()) {
        counters.committed = counters.appended;
      } else {
        ::unlink(target.c_str());
      }
    } else {
      // One file is left behind. Where that fails (no room for the checkpoint, somebody is reading) file and -wal
      // together are the take.
      sqlite3_exec(database->get(), "PRAGMA wal_checkpoint(TRUNCATE)", nullptr, nullptr, nullptr);
      sqlite3_exec(database->get(), "PRAGMA journal_mode=DELETE", nullptr, nullptr, nullptr);
      database.reset();
    }
    return verdict();
  }

  Result verdict() const { return counters.error.empty() ? Result{} : Result::bad(counters.error); }

  // The stamp of a message that we make ourselves: published when it was captured.
  Stamp stampFor(const std::string& topic, std::int64_t t_ns) {
    Stamp stamp;
    stamp.epoch = epoch;
    stamp.seq = ++sequence[topic];
    stamp.t_publish_ns = t_ns;
    stamp.t_realtime_ns =
        header.start_realtime_ns == 0 ? 0 : header.start_realtime_ns + (t_ns - header.start_monotonic_ns);
    latest_ns = std::max(latest_ns, t_ns);
    return stamp;
  }

  // Encodes with `encode` and appends; a refused frame costs no sequence number.
  template <typename Encode>
  Result appendOwn(const std::string& topic, std::int64_t t_ns, Encode encode) {
    const std::lock_guard lock(mutex);
    const Stamp stamp = stampFor(topic, t_ns);
    if (Result r = encode(stamp); !r) {
      --sequence[topic];
      ++counters.refused;
      return r;
    }
    enqueue(t_ns, topic, encoder.bytes());
    return {};
  }

  std::string path, target;
  TakeWriterOptions options;
  TakeHeader header;
  std::uint64_t epoch = 1;

  // Of the writer thread while it runs.
  std::optional<Database> database;
  std::optional<Statement> insert;
  std::int64_t last_id = 0;
  Batch writing;

  std::mutex mutex;  // guards all below
  std::condition_variable wake;
  Batch filling;
  std::map<std::string, std::uint32_t, std::less<>> topic_index;
  std::vector<const std::string*> topics;
  std::map<std::string, std::uint64_t> sequence;
  std::int64_t latest_ns = 0;
  Encoder encoder;
  Inspector inspector;
  TakeWriterCounters counters;
  bool stopping = false, finished = false;

  std::thread thread;
};

TakeWriter::TakeWriter(const std::string& path, const TakeHeader& header, const TakeWriterOptions& options)
    : state_(std::make_unique<State>(path, header, options)) {}

TakeWriter::~TakeWriter() {
  if (state_->options.reproducible && !state_->finished) {
    // Left behind by an error: half a take is no take.
    state_->insert.reset();
    state_->database.reset();
    ::unlink(state_->target.c_str());
    return;
  }
  (void)finish();
}

Result TakeWriter::finish() { return state_->finish(); }

TakeWriterCounters TakeWriter::counters() const {
  const std::lock_guard lock(state_->mutex);
  return state_->counters;
}

Result TakeWriter::append(std::string_view topic, Bytes payload) {
  Stamp stamp;
  Result r;
  {
    const std::lock_guard lock(state_->mutex);
    r = state_->inspector.check(payload, stamp);
    const std::optional<Topic> parsed = parseTopic(topic);
    if (r.ok() && (!parsed || parsed->kind != messageKind(payload)))
      r = Result::bad("the topic is not one of its message");
    if (!r.ok()) ++state_->counters.refused;
  }
  if (!r.ok()) return r;
  return appendChecked(topic, stamp, payload);
}

Result TakeWriter::appendChecked(std::string_view topic, const Stamp& stamp, Bytes payload) {
  const std::optional<MessageKind> kind = messageKind(payload);
  const bool has_capture = kind != MessageKind::character && kind != MessageKind::status;
  const std::int64_t t_ns = has_capture ? stamp.t_capture_ns : stamp.t_publish_ns;
  const std::lock_guard lock(state_->mutex);
  state_->latest_ns = std::max(state_->latest_ns, t_ns);
  state_->enqueue(t_ns, topic, payload);
  return {};
}

Result TakeWriter::append(const LandmarkFrame& frame, std::string_view source_name) {
  return state_->appendOwn(makeTopic(MessageKind::landmarks, source_name), frame.t_capture_ns,
                           [&](const Stamp& stamp) { return state_->encoder.encode(stamp, frame); });
}

Result TakeWriter::append(const MaskFrame& frame, std::string_view source_name) {
  return state_->appendOwn(makeTopic(MessageKind::mask, source_name), frame.t_capture_ns,
                           [&](const Stamp& stamp) { return state_->encoder.encode(stamp, frame); });
}

Result TakeWriter::append(const Character& character) {
  if (!isTopicName(character.name))
    return Result::bad("character message: the character's name cannot be part of a topic");
  std::int64_t t_ns = 0;
  {
    const std::lock_guard lock(state_->mutex);
    t_ns = state_->latest_ns;
  }
  return state_->appendOwn(makeTopic(MessageKind::character, character.name), t_ns,
                           [&](const Stamp& stamp) { return state_->encoder.encode(stamp, character); });
}

Result TakeWriter::append(const AvatarFrame& frame, std::string_view character_name, std::uint64_t character_id) {
  if (Result r = state_->appendOwn(
          makeTopic(MessageKind::weights, character_name), frame.t_capture_ns,
          [&](const Stamp& stamp) { return state_->encoder.encodeWeights(stamp, character_id, frame); });
      !r || frame.vertices.empty()) {
    return r;
  }
  return state_->appendOwn(makeTopic(MessageKind::mesh, character_name), frame.t_capture_ns,
                           [&](const Stamp& stamp) { return state_->encoder.encodeMesh(stamp, character_id, frame); });
}

}  // namespace volto::protocol
