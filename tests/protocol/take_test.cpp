#include <algorithm>
#include <chrono>
#include <fcntl.h>
#include <fstream>
#include <random>
#include <signal.h>
#include <spawn.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>

#include <gtest/gtest.h>
#include <sqlite3.h>

#include "protocol/clock.h"
#include "protocol/take_reader.h"
#include "protocol/take_writer.h"
#include "tests/protocol/samples.h"
#include "tests/support/test_data.h"

namespace volto::protocol {
namespace {

namespace fs = std::filesystem;
using test::sampleAvatar;
using test::sampleCharacter;
using test::sampleLandmarks;
using test::sampleMask;
using test::sampleStamp;

std::vector<char> bytesOfFile(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

void writeFile(const fs::path& path, const std::vector<char>& bytes) {
  std::ofstream out(path, std::ios::binary | std::ios::trunc);
  out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

SetupError::Kind kindOf(const std::function<void()>& action, std::string* what = nullptr) {
  try {
    action();
  } catch (const SetupError& e) {
    if (what != nullptr) *what = e.what();
    return e.kind();
  }
  ADD_FAILURE() << "nothing was thrown";
  return SetupError::Kind::failed;
}

TakeHeader sampleHeader() {
  TakeHeader header;
  header.name = "a take";
  header.source = "camera:/dev/video0";
  header.layout = "ibug68";
  header.actor = "nobody";
  header.note = "CC0, \xC3\xA9, it's";
  header.program = "volto test";
  header.start_realtime_ns = 1'700'000'000'000'000'000;
  header.start_monotonic_ns = 5;
  return header;
}

// A finished take of `frames` landmark frames.
fs::path writeTake(const fs::path& path, std::uint64_t frames, bool reproducible = true) {
  TakeWriterOptions options;
  options.reproducible = reproducible;
  TakeWriter writer(path, sampleHeader(), options);
  for (std::uint64_t n = 1; n <= frames; ++n) EXPECT_TRUE(writer.append(sampleLandmarks(n), "camera").ok());
  const Result r = writer.finish();
  EXPECT_TRUE(r.ok()) << r.problem;
  return path;
}

// Reads all there is; every frame that comes out must be one that went in.
std::uint64_t readAll(TakeReader& reader) {
  LandmarkMessage message;
  std::uint64_t count = 0;
  std::uint64_t last = 0;
  while (reader.next(message)) {
    const LandmarkFrame expected = sampleLandmarks(message.frame.capture_seq);
    EXPECT_EQ(message.frame.points_px, expected.points_px);
    EXPECT_EQ(message.frame.points_camera_mm, expected.points_camera_mm);
    EXPECT_GT(message.frame.capture_seq, last);
    last = message.frame.capture_seq;
    ++count;
  }
  return count;
}

class TakeTest : public ::testing::Test {
 protected:
  ::volto::test::TemporaryDir dir_;
};

TEST_F(TakeTest, WhatIsRecordedIsWhatIsReplayed) {
  const fs::path path = dir_ / "a.take";
  Encoder encoder;
  std::vector<std::vector<std::byte>> payloads;
  {
    TakeWriter writer(path, sampleHeader());
    for (std::uint64_t n = 1; n <= 100; ++n) {
      ASSERT_TRUE(encoder.encodeWeights(sampleStamp(n), 42, sampleAvatar(n)).ok());
      payloads.emplace_back(encoder.bytes().begin(), encoder.bytes().end());
      ASSERT_TRUE(writer.append("weights/anna/", encoder.bytes()).ok());
    }
    ASSERT_TRUE(writer.finish().ok());
    EXPECT_EQ(writer.counters().appended, 100U);
    EXPECT_EQ(writer.counters().committed, 100U);
    EXPECT_EQ(writer.counters().dropped, 0U);
  }
  TakeReader reader(path);
  EXPECT_TRUE(reader.finished());
  TakeRow row;
  for (std::size_t i = 0; i < payloads.size(); ++i) {
    ASSERT_TRUE(reader.next(row));
    EXPECT_EQ(row.topic, "weights/anna/");
    EXPECT_EQ(row.name, "anna");
    EXPECT_EQ(row.kind, MessageKind::weights);
    EXPECT_EQ(row.id, i + 1);
    EXPECT_EQ(row.t_ns, row.stamp.t_capture_ns);
    EXPECT_TRUE(std::equal(row.payload.begin(), row.payload.end(), payloads[i].begin(), payloads[i].end()))
        << "bytes changed on the way";
  }
  EXPECT_FALSE(reader.next(row));
  EXPECT_FALSE(reader.counters().damaged()) << reader.counters().first_problem;
  reader.rewind();
  ASSERT_TRUE(reader.next(row));
  EXPECT_EQ(row.id, 1U);
}

TEST_F(TakeTest, HeaderComesBack) {
  const fs::path path = writeTake(dir_ / "a.take", 1);
  const TakeReader reader(path);
  const TakeHeader expected = sampleHeader();
  EXPECT_EQ(reader.header().name, expected.name);
  EXPECT_EQ(reader.header().source, expected.source);
  EXPECT_EQ(reader.header().layout, expected.layout);
  EXPECT_EQ(reader.header().actor, expected.actor);
  EXPECT_EQ(reader.header().note, expected.note);
  EXPECT_EQ(reader.header().program, expected.program);
  EXPECT_EQ(reader.header().start_realtime_ns, expected.start_realtime_ns);
  EXPECT_EQ(reader.header().start_monotonic_ns, expected.start_monotonic_ns);
}

TEST_F(TakeTest, CleanEndLeavesOneFile) {
  writeTake(dir_ / "live.take", 10, false);
  writeTake(dir_ / "shipped.take", 10, true);
  std::vector<std::string> files;
  for (const auto& entry : fs::directory_iterator(dir_.path())) files.push_back(entry.path().filename());
  std::sort(files.begin(), files.end());
  EXPECT_EQ(files, (std::vector<std::string>{"live.take", "shipped.take"}));
}

TEST_F(TakeTest, ReproducibleTakesAreTheSameToTheByte) {
  const std::vector<char> first = bytesOfFile(writeTake(dir_ / "a.take", 50));
  const std::vector<char> second = bytesOfFile(writeTake(dir_ / "b.take", 50));
  EXPECT_GT(first.size(), 50U * 1000);
  EXPECT_TRUE(first == second);
}

TEST_F(TakeTest, ReproducibleTakeIsWholeOrNotThere) {
  const fs::path path = dir_ / "a.take";
  {
    TakeWriterOptions options;
    options.reproducible = true;
    TakeWriter writer(path, sampleHeader(), options);
    ASSERT_TRUE(writer.append(sampleLandmarks(), "camera").ok());
    EXPECT_FALSE(fs::exists(path));
  }
  EXPECT_TRUE(fs::is_empty(dir_.path()));
}

TEST_F(TakeTest, ExistingFileIsNotOverwrittenWithoutForce) {
  const fs::path path = dir_ / "a.take";
  writeFile(path, {'p', 'r', 'e', 'c', 'i', 'o', 'u', 's'});
  std::string what;
  for (const bool reproducible : {false, true}) {
    TakeWriterOptions options;
    options.reproducible = reproducible;
    EXPECT_EQ(kindOf([&] { TakeWriter(path, {}, options); }, &what), SetupError::Kind::failed);
    EXPECT_NE(what.find("exists"), std::string::npos) << what;
    EXPECT_EQ(bytesOfFile(path).size(), 8U);
    options.force = true;
    TakeWriter writer(path, sampleHeader(), options);
    ASSERT_TRUE(writer.append(sampleLandmarks(), "camera").ok());
    ASSERT_TRUE(writer.finish().ok());
    EXPECT_EQ(summarizeTake(path).streams.at("landmarks/camera/").messages, 1U);
    fs::remove(path);
    writeFile(path, {'p', 'r', 'e', 'c', 'i', 'o', 'u', 's'});
  }
}

TEST_F(TakeTest, JournalOfAnEarlierFileIsNotPlayedIntoTheNewOne) {
  const fs::path path = dir_ / "a.take";
  writeFile(dir_ / "a.take-wal", std::vector<char>(5000, 'x'));
  writeFile(dir_ / "a.take-journal", std::vector<char>(5000, 'x'));
  writeTake(path, 3, false);
  TakeReader reader(path);
  EXPECT_EQ(readAll(reader), 3U);
  EXPECT_FALSE(reader.counters().damaged());
}

TEST_F(TakeTest, FramesOfEveryKindAreAppendedWithTopicsAndSequence) {
  const fs::path path = dir_ / "a.take";
  const Character anna = sampleCharacter(9);
  const std::uint64_t id = characterId(anna);
  TakeWriter writer(path, sampleHeader());
  ASSERT_TRUE(writer.append(anna).ok());
  for (std::uint64_t n = 1; n <= 3; ++n) {
    ASSERT_TRUE(writer.append(sampleLandmarks(n), "camera").ok());
    ASSERT_TRUE(writer.append(sampleMask(n), "camera").ok());
    ASSERT_TRUE(writer.append(sampleAvatar(n, 9), "anna", id).ok());
  }
  LandmarkFrame bad = sampleLandmarks(4);
  bad.points_px.pop_back();
  EXPECT_FALSE(writer.append(bad, "camera").ok());
  ASSERT_TRUE(writer.append(sampleLandmarks(5), "camera").ok());
  ASSERT_TRUE(writer.finish().ok());
  EXPECT_EQ(writer.counters().refused, 1U);
  const TakeSummary summary = summarizeTake(path);
  ASSERT_EQ(summary.streams.size(), 5U);
  const TakeSummary::Stream& landmarks = summary.streams.at("landmarks/camera/");
  EXPECT_EQ(landmarks.messages, 4U);
  EXPECT_EQ(landmarks.lost, 0U) << "a refused frame costs no sequence number";
  EXPECT_EQ(landmarks.capture_lost, 1U) << "but frame 4 is missing";
  EXPECT_EQ(landmarks.first_ns, 16'666'667);
  EXPECT_EQ(landmarks.last_ns, 5 * 16'666'667);
  EXPECT_EQ(summary.streams.at("mesh/anna/").messages, 3U);
  EXPECT_EQ(summary.streams.at("weights/anna/").messages, 3U);
  EXPECT_EQ(summary.streams.at("mask/camera/").messages, 3U);
  EXPECT_EQ(summary.streams.at("character/anna/").messages, 1U);
  EXPECT_TRUE(summary.finished);
}

TEST_F(TakeTest, WhatIsNoMessageIsNotRecorded) {
  TakeWriter writer(dir_ / "a.take", {});
  Encoder encoder;
  ASSERT_TRUE(encoder.encode(sampleStamp(), sampleMask()).ok());
  EXPECT_FALSE(writer.append("weights/anna/", encoder.bytes()).ok()) << "a mask is no weights";
  EXPECT_FALSE(writer.append("nonsense", encoder.bytes()).ok());
  EXPECT_FALSE(writer.append("mask/camera/", encoder.bytes().first(100)).ok());
  EXPECT_FALSE(writer.append("mask/camera/", {}).ok());
  EXPECT_EQ(writer.counters().refused, 4U);
}

TEST_F(TakeTest, TakeThatIsBeingWrittenIsReadUpToWhatIsCommitted) {
  const fs::path path = dir_ / "a.take";
  TakeWriterOptions options;
  options.commit_interval_ms = 20;
  TakeWriter writer(path, sampleHeader(), options);
  TakeReader empty(path);
  EXPECT_EQ(readAll(empty), 0U);
  EXPECT_FALSE(empty.finished());
  for (std::uint64_t n = 1; n <= 40; ++n) ASSERT_TRUE(writer.append(sampleLandmarks(n), "camera").ok());
  for (int i = 0; i < 200 && writer.counters().committed < 40; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  TakeReader reader(path);
  EXPECT_EQ(readAll(reader), 40U);
  EXPECT_FALSE(reader.finished());
  EXPECT_FALSE(reader.counters().damaged()) << reader.counters().first_problem;
  empty.rewind();
  EXPECT_EQ(readAll(empty), 40U) << "rewinding sees what came in the meantime";
  // The writer is not disturbed by who reads.
  for (std::uint64_t n = 41; n <= 60; ++n) ASSERT_TRUE(writer.append(sampleLandmarks(n), "camera").ok());
  ASSERT_TRUE(writer.finish().ok());
  EXPECT_EQ(writer.counters().committed, 60U);
}

TEST_F(TakeTest, FullQueueDropsAndCounts) {
  TakeWriterOptions options;
  options.queue_bytes = 10'000;
  options.commit_interval_ms = 10'000;
  options.commit_bytes = 1'000'000;
  TakeWriter writer(dir_ / "a.take", {}, options);
  for (std::uint64_t n = 1; n <= 100; ++n) ASSERT_TRUE(writer.append(sampleLandmarks(n), "camera").ok());
  const TakeWriterCounters counters = writer.counters();
  EXPECT_GT(counters.dropped, 80U);
  EXPECT_EQ(counters.dropped + counters.appended, 100U);
  ASSERT_TRUE(writer.finish().ok());
  EXPECT_EQ(writer.counters().committed, counters.appended);
  EXPECT_GT(summarizeTake(dir_ / "a.take").counters.delivered, 3U);
}

// ---- killed, full, cut, flipped
// ----------------------------------------------------------------------------------------------------

struct Child {
  pid_t pid = 0;
  int out = -1;
};

Child startRecording(const fs::path& path, const std::vector<std::string>& arguments) {
  int pipe_fds[2];
  EXPECT_EQ(pipe2(pipe_fds, O_CLOEXEC), 0);
  std::vector<std::string> all{VOLTO_RECORD_CHILD, path.string()};
  all.insert(all.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  for (std::string& a : all) argv.push_back(a.data());
  argv.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, pipe_fds[1], STDOUT_FILENO);
  posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, (path.string() + ".err").c_str(),
                                   O_WRONLY | O_CREAT | O_TRUNC, 0644);
  Child child;
  EXPECT_EQ(posix_spawn(&child.pid, argv[0], &actions, nullptr, argv.data(), environ), 0);
  posix_spawn_file_actions_destroy(&actions);
  close(pipe_fds[1]);
  child.out = pipe_fds[0];
  return child;
}

// Capture times of all frames that the child had appended.
std::vector<std::int64_t> framesOf(const Child& child) {
  std::vector<std::int64_t> times;
  std::int64_t t = 0;
  while (read(child.out, &t, sizeof(t)) == static_cast<ssize_t>(sizeof(t))) times.push_back(t);
  close(child.out);
  return times;
}

TEST_F(TakeTest, KilledRecordingLosesLessThanASecond) {
  std::mt19937 random(7);
  for (int round = 0; round < 5; ++round) {
    const fs::path path = dir_ / ("killed" + std::to_string(round) + ".take");
    const Child child = startRecording(path, {"100000", "500"});
    std::this_thread::sleep_for(std::chrono::milliseconds(50 + random() % 500));
    kill(child.pid, SIGKILL);
    const std::int64_t t_killed_ns = monotonicNs();
    int status = 0;
    waitpid(child.pid, &status, 0);
    const std::vector<std::int64_t> appended = framesOf(child);
    if (!looksLikeTake(path)) {
      // Killed before the file had its first page.
      EXPECT_LT(appended.size(), 500U);
      continue;
    }
    TakeReader reader(path);
    EXPECT_FALSE(reader.finished());
    std::int64_t last = 0;
    TakeRow row;
    std::uint64_t rows = 0;
    while (reader.next(row)) {
      ASSERT_LT(rows, appended.size());
      EXPECT_EQ(row.t_ns, appended[rows++]) << "frames come out in order and unchanged";
      last = row.t_ns;
    }
    EXPECT_EQ(reader.counters().bad_rows, 0U) << reader.counters().first_problem;
    // Counted in frames that were appended more than a second before the end and are missing.
    const auto older = static_cast<std::uint64_t>(std::count_if(
        appended.begin(), appended.end(), [&](std::int64_t t) { return t < t_killed_ns - 1'000'000'000; }));
    EXPECT_GE(rows, older);
    if (!appended.empty() && rows > 0) {
      EXPECT_LT(appended.back() - last, 1'000'000'000);
    }
  }
}

TEST_F(TakeTest, FullDiskEndsTheRecordingAndKeepsWhatIsThere) {
  const fs::path path = dir_ / "full.take";
  const Child child = startRecording(path, {"3000", "20000", "1000000"});
  const std::size_t appended = framesOf(child).size();
  int status = 0;
  waitpid(child.pid, &status, 0);
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 1);
  EXPECT_EQ(appended, 3000U) << "who records goes on without noticing";
  const std::vector<char> said = bytesOfFile(path.string() + ".err");
  const std::string message(said.begin(), said.end());
  EXPECT_NE(message.find("full.take: "), std::string::npos) << message;
  EXPECT_NE(message.find("the recording ended here"), std::string::npos) << message;
  EXPECT_EQ(std::count(message.begin(), message.end(), '\n'), 1) << message;
  TakeReader reader(path);
  const std::uint64_t kept = readAll(reader);
  EXPECT_FALSE(reader.counters().damaged()) << reader.counters().first_problem;
  EXPECT_FALSE(reader.finished());
  RecordProperty("kept", static_cast<int>(kept));
  EXPECT_LT(kept, 3000U);
}

TEST_F(TakeTest, TakeCutAnywhereGivesOnlyRightFrames) {
  const std::vector<char> whole = bytesOfFile(writeTake(dir_ / "whole.take", 40));
  const fs::path path = dir_ / "cut.take";
  std::size_t opened = 0, frames = 0;
  std::mt19937 random(3);
  std::vector<std::size_t> sizes{0, 1, 7, 15, 16, 99, 100, 101, 4095, 4096, 4097, 8192, 12288, whole.size() - 1};
  for (std::size_t s = 4096; s < whole.size(); s += 4096) sizes.push_back(s + random() % 4096);
  for (const std::size_t size : sizes) {
    writeFile(path, {whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size)});
    try {
      TakeReader reader(path);
      ++opened;
      const std::uint64_t got = readAll(reader);
      EXPECT_LT(got, 40U);
      EXPECT_TRUE(reader.counters().damaged()) << "cut to " << size;
      if (reader.finished()) {
        EXPECT_EQ(got + reader.counters().lost_rows + reader.counters().bad_rows, 40U) << "every loss is known";
      }
      frames += got;
    } catch (const SetupError& e) {
      EXPECT_EQ(e.kind(), SetupError::Kind::bad_data) << e.what();
      EXPECT_EQ(std::string(e.what()).rfind(path.string() + ": ", 0), 0U) << e.what();
    }
  }
  EXPECT_GT(opened, 3U);
  EXPECT_GT(frames, 20U) << "what is there is read";
}

TEST_F(TakeTest, FlippedBitsNeverGiveAWrongFrame) {
  const std::vector<char> whole = bytesOfFile(writeTake(dir_ / "whole.take", 30));
  const fs::path path = dir_ / "flipped.take";
  std::mt19937 random(11);
  std::size_t detected = 0, complete = 0;
  for (int round = 0; round < 250; ++round) {
    std::vector<char> bytes = whole;
    for (std::size_t flips = 1 + random() % 3; flips > 0; --flips) {
      const std::size_t range = random() % 4 == 0 ? 4096 * 3 : bytes.size();
      bytes[random() % range] ^= static_cast<char>(1U << (random() % 8));
    }
    writeFile(path, bytes);
    try {
      TakeReader reader(path);
      const std::uint64_t got = readAll(reader);  // compares every frame with what was recorded
      EXPECT_LE(got, 30U);
      if (got < 30U) {
        EXPECT_TRUE(reader.counters().damaged());
      }
      ++(got < 30U ? detected : complete);
    } catch (const SetupError& e) {
      EXPECT_EQ(e.kind(), SetupError::Kind::bad_data) << e.what();
      ++detected;
    }
  }
  EXPECT_GT(detected, 50U);
  EXPECT_GT(complete, 10U) << "a bit in free space harms nothing";
}

TEST_F(TakeTest, OneBadRowIsSkippedCountedAndNamed) {
  const fs::path path = writeTake(dir_ / "a.take", 20);
  sqlite3* db = nullptr;
  ASSERT_EQ(sqlite3_open(path.c_str(), &db), SQLITE_OK);
  ASSERT_EQ(sqlite3_exec(
                db,
                "UPDATE messages SET topic='landmarks/other/' WHERE id=5; UPDATE messages SET t_ns=t_ns+1 WHERE id=7;"
                "UPDATE messages SET payload=x'' WHERE id=9; DELETE FROM messages WHERE id=11;"
                "UPDATE messages SET payload=(SELECT payload FROM messages WHERE id=1) WHERE id=13",
                nullptr, nullptr, nullptr),
            SQLITE_OK);
  sqlite3_close(db);
  TakeReader reader(path);
  EXPECT_EQ(readAll(reader), 15U);
  EXPECT_EQ(reader.counters().bad_rows, 4U);
  EXPECT_EQ(reader.counters().lost_rows, 1U);
  EXPECT_EQ(reader.counters().first_problem, path.string() + ": row 5: the checksum does not match");
}

TEST_F(TakeTest, RecoveryKeepsWhatCanBeReadAndSaysWhatCannot) {
  std::vector<char> bytes = bytesOfFile(writeTake(dir_ / "whole.take", 60));
  bytes.resize(bytes.size() * 2 / 3);
  writeFile(dir_ / "cut.take", bytes);
  const TakeReaderCounters lost = recoverTake(dir_ / "cut.take", dir_ / "saved.take");
  EXPECT_TRUE(lost.damaged());
  EXPECT_EQ(lost.delivered + lost.lost_rows + lost.bad_rows, 60U);
  TakeReader saved(dir_ / "saved.take");
  EXPECT_EQ(readAll(saved), lost.delivered);
  EXPECT_GT(lost.delivered, 20U);
  EXPECT_FALSE(saved.counters().damaged());
  EXPECT_TRUE(saved.finished());
  EXPECT_EQ(saved.header().name, "a take");
  EXPECT_EQ(kindOf([&] { recoverTake(dir_ / "cut.take", dir_ / "saved.take"); }), SetupError::Kind::failed);
  EXPECT_EQ(kindOf([&] { recoverTake(dir_ / "cut.take", dir_ / "cut.take", true); }), SetupError::Kind::failed);
  EXPECT_TRUE(fs::exists(dir_ / "cut.take"));
}

TEST_F(TakeTest, WhatIsNoTakeIsRefusedWithAReason) {
  const fs::path path = dir_ / "x.take";
  std::string what;
  EXPECT_EQ(kindOf([&] { TakeReader r(path); }, &what), SetupError::Kind::no_input);
  EXPECT_EQ(what, path.string() + ": no such file");
  EXPECT_EQ(kindOf([&] { TakeReader r(dir_.path()); }), SetupError::Kind::no_input);
  for (const std::string& content :
       {std::string(), std::string("SQLite "), std::string("timestamp,jawOpen\n0,1\n"), std::string(5000, '\xFF')}) {
    writeFile(path, {content.begin(), content.end()});
    EXPECT_FALSE(looksLikeTake(path));
    EXPECT_EQ(kindOf([&] { TakeReader r(path); }, &what), SetupError::Kind::bad_data);
    EXPECT_EQ(what, path.string() + ": not a take: it does not begin like an SQLite file");
  }
  fs::remove(path);
  sqlite3* db = nullptr;
  ASSERT_EQ(sqlite3_open(path.c_str(), &db), SQLITE_OK);
  ASSERT_EQ(sqlite3_exec(db, "CREATE TABLE messages (id INTEGER PRIMARY KEY, t_ns, topic, payload, crc)", nullptr,
                         nullptr, nullptr),
            SQLITE_OK);
  sqlite3_close(db);
  EXPECT_EQ(kindOf([&] { TakeReader r(path); }, &what), SetupError::Kind::bad_data);
  EXPECT_NE(what.find("another program"), std::string::npos) << what;
}

TEST_F(TakeTest, TakeWithAnythingElseInItIsRefusedAndNotObeyed) {
  const std::vector<std::string> attacks{
      "CREATE TRIGGER t AFTER INSERT ON messages BEGIN DELETE FROM messages; END",
      "CREATE VIEW v AS SELECT * FROM messages",
      "CREATE TABLE extra (a)",
      "ALTER TABLE messages ADD COLUMN more INTEGER",
      "DROP TABLE header",
      "CREATE INDEX i ON messages(t_ns)",
      "DROP TABLE messages; CREATE VIEW messages AS SELECT 1 AS id, 2 AS t_ns, 'status/' AS topic, x'00' AS payload, 3 "
      "AS crc",
  };
  const std::vector<char> good = bytesOfFile(writeTake(dir_ / "good.take", 2));
  for (const std::string& sql : attacks) {
    const fs::path path = dir_ / "attacked.take";
    writeFile(path, good);
    sqlite3* db = nullptr;
    ASSERT_EQ(sqlite3_open(path.c_str(), &db), SQLITE_OK);
    ASSERT_EQ(sqlite3_exec(db, sql.c_str(), nullptr, nullptr, nullptr), SQLITE_OK) << sql;
    sqlite3_close(db);
    EXPECT_EQ(kindOf([&] { TakeReader r(path); }), SetupError::Kind::bad_data) << sql;
  }
}

TEST_F(TakeTest, TakeOfANewerVersionSaysSo) {
  const fs::path path = writeTake(dir_ / "a.take", 1);
  sqlite3* db = nullptr;
  ASSERT_EQ(sqlite3_open(path.c_str(), &db), SQLITE_OK);
  ASSERT_EQ(sqlite3_exec(db, "PRAGMA user_version=2", nullptr, nullptr, nullptr), SQLITE_OK);
  sqlite3_close(db);
  std::string what;
  EXPECT_EQ(kindOf([&] { TakeReader r(path); }, &what), SetupError::Kind::bad_data);
  EXPECT_EQ(what, path.string() + ": made by a newer version of Volto (take version 2, this program reads up to 1)");
}

TEST_F(TakeTest, TakeOnAReadOnlyMediumIsRead) {
  const fs::path folder = dir_ / "medium";
  fs::create_directory(folder);
  const fs::path path = writeTake(folder / "a #1?.take", 4);
  chmod(path.c_str(), 0444);
  chmod(folder.c_str(), 0555);
  TakeReader reader(path);
  EXPECT_EQ(readAll(reader), 4U);
  chmod(folder.c_str(), 0755);
}

TEST_F(TakeTest, FolderThatDoesNotExistIsNamed) {
  std::string what;
  EXPECT_EQ(kindOf([&] { TakeWriter(dir_ / "no/such/a.take", {}); }, &what), SetupError::Kind::failed);
  EXPECT_NE(what.find("no/such/a.take: cannot be made: No such file or directory"), std::string::npos) << what;
}

}  // namespace
}  // namespace volto::protocol
