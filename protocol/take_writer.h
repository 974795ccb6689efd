// TakeWriter: a recording (take) as one SQLite file; protocol/README.md has the schema. What is recorded is what is
// replayed.
//
// Threads: append... is thread-safe and never waits for the disk: a bounded queue (8 MiB) leads to a writer thread that
// commits every 250 ms or 1 MiB. A killed process loses at most the last 250 ms. A full disk ends the recording, keeps
// what is there, and says so in counters().error; appending goes on without effect.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "protocol/codec.h"
#include "protocol/topics.h"

namespace volto::protocol {

// Beside the messages. All text; the reader hands back what the writer was given.
struct TakeHeader {
  std::string name;    // of the take, for people
  std::string source;  // camera, file or endpoint it came from
  std::string layout;  // of the landmarks: "ibug68", "openseeface66", "mediapipe478", or empty
  std::string actor;
  std::string note;               // licence, what was asked of the actor ...
  std::string program = "volto";  // that wrote it, with its version
  std::int64_t start_realtime_ns =
      0;  // wall clock at start_monotonic_ns; 0: taken from the clock (0 stays 0 in a reproducible take)
  std::int64_t start_monotonic_ns = 0;
};

struct TakeWriterOptions {
  bool force = false;  // overwrite a file that exists
  // For takes that are shipped: same calls, same bytes. Nothing comes from a clock or a random number, all is written
  // in one go when finish() is called (to PATH.part, then renamed), and nothing is dropped: append waits.
  bool reproducible = false;
  std::size_t queue_bytes = 8U << 20U;
  int commit_interval_ms = 250;
  std::size_t commit_bytes = 1U << 20U;
};

struct TakeWriterCounters {
  std::uint64_t appended = 0;   // accepted
  std::uint64_t committed = 0;  // safe in the file
  std::uint64_t dropped = 0;    // queue full, or recording had ended
  std::uint64_t refused = 0;    // not a message
  std::string error;            // why the recording ended early: "PATH: database or disk is full"; empty: it did not
};

class TakeWriter {
 public:
  // Creates the file. Throws SetupError: failed (exists, cannot be made).
  TakeWriter(const std::string& path, const TakeHeader& header, const TakeWriterOptions& options = {});
  // As finish(), its Result ignored. A reproducible take that was not finished is thrown away.
  ~TakeWriter();
  TakeWriter(const TakeWriter&) = delete;
  TakeWriter& operator=(const TakeWriter&) = delete;

  // A message as it was on the wire. Refused (and counted) unless topic and payload are a message that readers would
  // accept.
  Result append(std::string_view topic, Bytes payload);
  // The same for a message that checkMessage has already accepted, as a Subscriber's has.
  Result appendChecked(std::string_view topic, const Stamp& stamp, Bytes payload);

  // Encodes and appends; seq counts per topic from 1, t_publish_ns is t_capture_ns. A name that is none throws
  // SetupError (makeTopic).
  Result append(const LandmarkFrame& frame, std::string_view source_name);
  Result append(const MaskFrame& frame, std::string_view source_name);
  Result append(const Character& character);
  // weights/, and mesh/ when it has vertices. character_id: characterId of the character that was appended.
  Result append(const AvatarFrame& frame, std::string_view character_name, std::uint64_t character_id);

  // Writes what waits, leaves one clean file behind (no -wal), stops. Not ok: what went wrong, also earlier; the file
  // holds counters().committed.
  Result finish();

  TakeWriterCounters counters() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace volto::protocol
