#include "protocol/take_database.h"

#include "protocol/crc32c.h"

namespace volto::protocol {
namespace {

Bytes bytesOf(const void* data, std::size_t size) { return {static_cast<const std::byte*>(data), size}; }

}  // namespace

std::uint32_t rowCrc(std::int64_t id, std::int64_t t_ns, std::string_view topic, Bytes payload) {
  std::uint32_t crc = crc32c(bytesOf(&id, sizeof(id)));
  crc = crc32c(bytesOf(&t_ns, sizeof(t_ns)), crc);
  crc = crc32c(bytesOf(topic.data(), topic.size()), crc);
  return crc32c(payload, crc);
}

std::uint32_t headerCrc(std::string_view key, std::string_view value) {
  std::uint32_t crc = crc32c(bytesOf(key.data(), key.size()));
  crc = crc32c(bytesOf("", 1), crc);
  return crc32c(bytesOf(value.data(), value.size()), crc);
}

Statement::Statement(sqlite3* db, const char* sql) {
  sqlite3_stmt* statement = nullptr;
  const int code = sqlite3_prepare_v3(db, sql, -1, SQLITE_PREPARE_PERSISTENT, &statement, nullptr);
  if (code != SQLITE_OK) throw DatabaseError(code, sqlite3_errmsg(db));
  statement_.reset(statement);
}

std::string_view Statement::text(int column) {
  const auto* data = reinterpret_cast<const char*>(sqlite3_column_text(statement_.get(), column));
  if (data == nullptr) return {};
  return {data, static_cast<std::size_t>(sqlite3_column_bytes(statement_.get(), column))};
}

Bytes Statement::blob(int column) {
  const void* data = sqlite3_column_blob(statement_.get(), column);
  if (data == nullptr) return {};
  return bytesOf(data, static_cast<std::size_t>(sqlite3_column_bytes(statement_.get(), column)));
}

Database::Database(const std::string& path, int flags) {
  sqlite3* db = nullptr;
  const int code = sqlite3_open_v2(path.c_str(), &db, flags, nullptr);
  db_.reset(db);
  if (code != SQLITE_OK) throw DatabaseError(code, db != nullptr ? sqlite3_errmsg(db) : "out of memory");
}

void Database::execute(const char* sql) {
  const int code = sqlite3_exec(db_.get(), sql, nullptr, nullptr, nullptr);
  if (code != SQLITE_OK) throw DatabaseError(code, message());
}

}  // namespace volto::protocol
