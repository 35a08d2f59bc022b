// ROS 2 bags in SQLite files: the tables topics (id, name, type, serialization_format) and messages (id, topic_id,
// timestamp, data). Messages may be compressed one by one with zstd.
#include <fmt/format.h>
#include <sqlite3.h>

#include <algorithm>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <system_error>
#include <utility>

#include "base/byte_reader.h"
#include "containers/input_file.h"
#include "containers/message_file.h"

namespace bslam::containers {
namespace {

struct CloseDatabase {
  void operator()(sqlite3* database) const { sqlite3_close(database); }
};
using Database = std::unique_ptr<sqlite3, CloseDatabase>;
struct FinishStatement {
  void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
};
using Statement = std::unique_ptr<sqlite3_stmt, FinishStatement>;
struct CloseBlob {
  void operator()(sqlite3_blob* blob) const { sqlite3_blob_close(blob); }
};

Statement prepare(sqlite3* database, const char* text) {
  sqlite3_stmt* statement = nullptr;
  sqlite3_prepare_v2(database, text, -1, &statement, nullptr);
  return Statement(statement);
}

std::string text(sqlite3_stmt* row, int column) {
  const auto* bytes = reinterpret_cast<const char*>(sqlite3_column_text(row, column));
  return bytes == nullptr ? "" : std::string(bytes, static_cast<std::size_t>(sqlite3_column_bytes(row, column)));
}

// Escapes a file name for use in a URI.
std::string uri_of(const std::filesystem::path& path) {
  std::string uri = path.is_absolute() ? "file://" : "file:";  // else `//` would begin the name of a server
  for (const unsigned char c : path.string())
    uri +=
        (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '/' || c == '.' || c == '-'
            ? std::string(1, static_cast<char>(c))
            : fmt::format("%{:02x}", c);
  return uri + "?mode=ro&immutable=1";
}

class SqliteBag : public MessageFile {
 public:
  SqliteBag(const InputFile& file, Database database) : database_(std::move(database)), file_size_(file.size()) {
    path_ = file.path();
    format_ = "ROS 2 bag (sqlite3)";
  }

  Status index(const InputFile& file);

  Result<std::string> read(const MessageRef& message, std::size_t max_bytes) const override {
    const std::lock_guard lock(mutex_);
    sqlite3_blob* opened = nullptr;
    const int status = sqlite3_blob_open(database_.get(), "main", "messages", "data",
                                         static_cast<sqlite3_int64>(message.at), 0, &opened);
    const std::unique_ptr<sqlite3_blob, CloseBlob> blob(opened);
    if (status != SQLITE_OK) return damaged();
    const auto size = static_cast<std::size_t>(std::max(0, sqlite3_blob_bytes(blob.get())));
    if (size > file_size_) {
      return Error{path_.string(), "", fmt::format("a message of {} bytes in a file of {} bytes", size, file_size_),
                   "a complete message"};
    }
    std::string data = part(blob.get(), std::min(size, max_bytes));
    if (data.empty() && size > 0) return damaged();
    if (!is_compressed_message(data)) return data;
    if (data.size() < size) data = part(blob.get(), size);
    data = decompressed_message(data, max_bytes);
    return data.empty() ? damaged() : Result<std::string>(std::move(data));
  }

 private:
  Result<std::string> damaged() const {
    return Error{path_.string(), "",
                 std::string("a message that cannot be read (") + sqlite3_errmsg(database_.get()) + ")",
                 "a complete message"};
  }
  static std::string part(sqlite3_blob* blob, std::size_t count) {
    std::string data(count, '\0');
    if (count > 0 && sqlite3_blob_read(blob, data.data(), static_cast<int>(count), 0) != SQLITE_OK) data.clear();
    return data;
  }

  Status read_topics();
  void check_size(const InputFile& file);
  void check_log();
  Error bad_schema(const std::string& found) const;

  Database database_;
  std::uint64_t file_size_;
  bool has_log_ = false;
  std::map<std::int64_t, std::uint32_t> topic_of_;  // by the ids of the file
  mutable std::mutex mutex_;
};

// Views and virtual tables could execute code from an untrusted file.
bool has_plain_table(sqlite3* database, const char* name) {
  const Statement row = prepare(database, "SELECT type, sql FROM sqlite_schema WHERE name = ?");
  if (!row) return false;
  sqlite3_bind_text(row.get(), 1, name, -1, SQLITE_STATIC);
  return sqlite3_step(row.get()) == SQLITE_ROW && text(row.get(), 0) == "table" &&
         sqlite3_strnicmp(text(row.get(), 1).c_str(), "create table", 12) == 0;
}

Error SqliteBag::bad_schema(const std::string& found) const {
  return Error{path_.string(), "", found, "the tables topics and messages of a ROS 2 bag"};
}

Status SqliteBag::read_topics() {
  if (!has_plain_table(database_.get(), "topics") || !has_plain_table(database_.get(), "messages")) {
    const int status = sqlite3_errcode(database_.get());
    const bool readable = status == SQLITE_OK || status == SQLITE_DONE || status == SQLITE_ROW;
    if (!readable) return bad_schema(sqlite3_errmsg(database_.get()));
    return bad_schema(has_log_ ? "no such tables outside of its write-ahead log" : "other tables");
  }
  const Statement rows = prepare(database_.get(), "SELECT id, name, type, serialization_format FROM topics");
  if (!rows) return bad_schema(sqlite3_errmsg(database_.get()));
  int status = SQLITE_ROW;
  while ((status = sqlite3_step(rows.get())) == SQLITE_ROW) {
    topic_of_[sqlite3_column_int64(rows.get(), 0)] = static_cast<std::uint32_t>(topics_.size());
    const std::string format = text(rows.get(), 3);
    topics_.push_back({text(rows.get(), 1), plain_type(text(rows.get(), 2)), format,
                       format == "cdr" ? Serialisation::kCdr : Serialisation::kOther});
  }
  if (topics_.empty()) return bad_schema(status == SQLITE_DONE ? "no topics" : sqlite3_errmsg(database_.get()));
  return {};
}

// A file that is shorter than its header says has lost pages, which read as zeros.
void SqliteBag::check_size(const InputFile& file) {
  const std::string header = file.read(0, 100);
  ByteReader in(header, std::endian::big);
  in.skip(16);
  const auto page_size = in.number<std::uint16_t>();  // 1 means 65536
  in.skip(6);
  const auto changes = in.number<std::uint32_t>(), pages = in.number<std::uint32_t>();
  in.skip(60);
  const auto valid_for = in.number<std::uint32_t>();  // the number of pages is valid for this number of changes
  const std::uint64_t size = std::uint64_t{pages} * (page_size == 1 ? 65536u : page_size);
  if (!in.ok() || changes != valid_for || size <= file.size()) return;
  warnings_.push_back(fmt::format("{}: cut off at byte {} of {}", path_.string(), file.size(), size));
}

// SQLite would write an index of the log beside the recording, so the log is not read.
void SqliteBag::check_log() {
  const std::string log = path_.string() + "-wal";
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(log, error);
  has_log_ = !error && size > 0;
  if (!has_log_) return;
  warnings_.push_back(
      fmt::format("{}: the last messages may be missing: its recorder did not move them out of {}, which is not read",
                  path_.string(), log));
}

Status SqliteBag::index(const InputFile& file) {
  check_size(file);
  check_log();
  if (const Status s = read_topics(); !s) return s;
  const Statement rows = prepare(database_.get(), "SELECT id, topic_id, timestamp FROM messages");
  if (!rows) return bad_schema(sqlite3_errmsg(database_.get()));
  std::uint64_t seen = 0, unknown = 0;
  int status = SQLITE_ROW;
  while ((status = sqlite3_step(rows.get())) == SQLITE_ROW) {
    // In a damaged tree the iteration may return to rows that were already read.
    if (++seen > file.size()) break;
    const auto topic = topic_of_.find(sqlite3_column_int64(rows.get(), 1));
    if (topic == topic_of_.end()) {
      ++unknown;
      continue;
    }
    count_message(topic->second, sqlite3_column_int64(rows.get(), 2), 0,
                  static_cast<std::uint64_t>(sqlite3_column_int64(rows.get(), 0)));
  }
  if (status != SQLITE_DONE) {
    warnings_.push_back(fmt::format("{}: damaged or cut off ({}) after {} messages; the rest is not read",
                                    path_.string(), sqlite3_errmsg(database_.get()), seen));
  }
  if (unknown > 0)
    warnings_.push_back(fmt::format("{}: {} messages of unknown topics are not used", path_.string(), unknown));
  return {};
}

}  // namespace

MessageFileResult open_sqlite_bag(const std::filesystem::path& path) {
  const auto file = InputFile::open(path);
  if (!file) return file.error();
  sqlite3* opened = nullptr;
  const int status = sqlite3_open_v2(uri_of(path).c_str(), &opened, SQLITE_OPEN_READONLY | SQLITE_OPEN_URI, nullptr);
  Database database(opened);
  if (status != SQLITE_OK || !database)
    return Error{path.string(), "", database ? sqlite3_errmsg(database.get()) : "no memory", "an SQLite file"};
  // Otherwise a file that is shorter than its header says could not be read at all. Nothing is written: it is
  // read-only, and no files are made beside it, since it is opened as unchangeable.
  sqlite3_db_config(database.get(), SQLITE_DBCONFIG_WRITABLE_SCHEMA, 1, nullptr);
  sqlite3_db_config(database.get(), SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
  auto bag = std::make_unique<SqliteBag>(*file, std::move(database));
  if (const Status s = bag->index(*file); !s) return s.error();
  return std::unique_ptr<MessageFile>(std::move(bag));
}

}  // namespace bslam::containers
