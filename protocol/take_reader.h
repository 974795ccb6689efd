// TakeReader: messages of a take in the order they were recorded. Thread-bound. The file is never written to.
//
// A damaged file is read as far as it goes: a row whose CRC is wrong or whose message does not verify is skipped and
// counted; nothing wrong is ever handed out. A take that is still being written is read up to what is committed. A file
// that is no take (or carries triggers, views, other tables) is refused.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <string_view>

#include "protocol/take_writer.h"

namespace volto::protocol {

struct TakeReaderCounters {
  std::uint64_t delivered = 0;
  std::uint64_t bad_rows = 0;        // CRC, Verifier or semantic checks failed, or the row could not be read
  std::uint64_t unknown_topics = 0;  // well kept, but of a kind this program does not know: skipped
  std::uint64_t lost_rows = 0;       // known to have been written (numbers missing in the row), not there any more
  std::string first_problem;         // of the first bad row, with its number
  bool damaged() const { return bad_rows + lost_rows > 0 || file_damaged; }
  bool file_damaged = false;  // SQLite's own check complained, or the header's CRC did
};

// Valid until the next call on the reader.
struct TakeRow {
  std::uint64_t id = 0;
  std::int64_t t_ns = 0;  // t_capture_ns, or t_publish_ns of a message that belongs to no frame
  std::string_view topic;
  MessageKind kind = MessageKind::status;
  std::string_view name;  // of the topic
  Bytes payload;          // aligned; decode(payload, ...) succeeds
  Stamp stamp;
};

class TakeReader {
 public:
  // Throws SetupError: no_input, bad_data ("X: not a take ...", "made by a newer version ...").
  explicit TakeReader(const std::string& path);
  ~TakeReader();
  TakeReader(TakeReader&&) noexcept;
  TakeReader& operator=(TakeReader&&) noexcept;

  const TakeHeader& header() const;
  bool finished() const;  // ended cleanly; otherwise its writer was killed, failed or is still at it

  bool next(TakeRow& row);          // false: the end
  bool next(LandmarkMessage& out);  // the next landmarks message, others passed over
  bool next(MaskMessage& out);
  void rewind();  // from the start, counters too; sees what was committed in the meantime

  const TakeReaderCounters& counters() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

// What is in a take; reads all of it.
struct TakeSummary {
  TakeHeader header;
  bool finished = false;
  struct Stream {
    MessageKind kind = MessageKind::status;
    std::uint64_t messages = 0;
    std::uint64_t lost = 0;          // gaps in seq
    std::uint64_t capture_lost = 0;  // gaps in capture_seq
    std::uint64_t bytes = 0;
    std::int64_t first_ns = 0, last_ns = 0;
    double rate_hz() const {
      return messages > 1 && last_ns > first_ns
                 ? static_cast<double>(messages - 1) * 1e9 / static_cast<double>(last_ns - first_ns)
                 : 0.0;
    }
  };
  std::map<std::string, Stream> streams;  // by topic
  TakeReaderCounters counters;
};
TakeSummary summarizeTake(const std::string& path);

// Whether the file looks like a take: an SQLite file with our application id. Opens nothing else.
bool looksLikeTake(const std::string& path);

// Copies all that can be read into a fresh take. Returns what was lost on the way. Throws SetupError.
TakeReaderCounters recoverTake(const std::string& in, const std::string& out, bool force = false);

}  // namespace volto::protocol
