// What writer and reader of a take share: the schema, the checksum, and SQLite behind RAII. Not for other folders.
#pragma once

#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>

#include <sqlite3.h>

#include "protocol/codec.h"

namespace volto::protocol {

inline constexpr std::int32_t kTakeApplicationId = 0x564C544F;  // "VLTO"
inline constexpr std::int32_t kTakeVersion = 1;                 // PRAGMA user_version

// Word for word what must be in sqlite_schema.
inline constexpr const char* kHeaderTableSql =
    "CREATE TABLE header (key TEXT NOT NULL PRIMARY KEY, value TEXT NOT NULL, crc INTEGER NOT NULL) STRICT, WITHOUT "
    "ROWID";
inline constexpr const char* kMessagesTableSql =
    "CREATE TABLE messages (id INTEGER PRIMARY KEY, t_ns INTEGER NOT NULL, topic TEXT NOT NULL, payload BLOB NOT NULL, "
    "crc INTEGER NOT NULL) STRICT";

// CRC-32C of id and t_ns (8 bytes each, little-endian), topic, payload: all of a row.
std::uint32_t rowCrc(std::int64_t id, std::int64_t t_ns, std::string_view topic, Bytes payload);
// CRC-32C of key, a zero byte, value.
std::uint32_t headerCrc(std::string_view key, std::string_view value);

struct DatabaseError : std::runtime_error {
  DatabaseError(int sqlite_code, const std::string& what) : std::runtime_error(what), code(sqlite_code) {}
  int code;
};

class Statement {
 public:
  Statement(sqlite3* db, const char* sql);  // throws DatabaseError
  // SQLITE_ROW, SQLITE_DONE or an error; never throws.
  int step() { return sqlite3_step(statement_.get()); }
  void reset() { sqlite3_reset(statement_.get()); }
  void bind(int index, std::int64_t value) { sqlite3_bind_int64(statement_.get(), index, value); }
  // Both must stay as they are until the next reset.
  void bind(int index, std::string_view text) {
    sqlite3_bind_text64(statement_.get(), index, text.data(), text.size(), SQLITE_STATIC, SQLITE_UTF8);
  }
  void bind(int index, Bytes blob) {
    sqlite3_bind_blob64(statement_.get(), index, blob.data(), blob.size(), SQLITE_STATIC);
  }
  std::int64_t integer(int column) { return sqlite3_column_int64(statement_.get(), column); }
  // Valid until the next step.
  std::string_view text(int column);
  Bytes blob(int column);
  bool isType(int column, int type) { return sqlite3_column_type(statement_.get(), column) == type; }

 private:
  struct Finalize {
    void operator()(sqlite3_stmt* s) const { sqlite3_finalize(s); }
  };
  std::unique_ptr<sqlite3_stmt, Finalize> statement_;
};

class Database {
 public:
  // flags: of sqlite3_open_v2. Throws DatabaseError.
  Database(const std::string& path, int flags);
  sqlite3* get() const { return db_.get(); }
  void execute(const char* sql);  // throws DatabaseError
  std::string message() const { return sqlite3_errmsg(db_.get()); }

 private:
  struct Close {
    void operator()(sqlite3* db) const { sqlite3_close_v2(db); }
  };
  std::unique_ptr<sqlite3, Close> db_;
};

}  // namespace volto::protocol
