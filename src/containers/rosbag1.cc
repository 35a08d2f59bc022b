// ROS 1 bags, format 2.0: records, each with a header of fields "name=value" and data. A bag is read record by record
// from its beginning, so that a bag without an index, whose recorder was killed, is read in the same way. The data of a
// chunk is skipped if an index of its messages follows.
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "base/byte_reader.h"
#include "containers/chunked_file.h"

namespace bslam::containers {
namespace {

constexpr std::uint64_t kMaxHeaderBytes = std::uint64_t{1} << 20, kMaxDataBytes = std::uint64_t{1} << 26;
constexpr unsigned char kMessage = 2, kBagHeader = 3, kIndex = 4, kChunk = 5, kChunkInfo = 6, kConnection = 7;

// The fields of a header; if a name occurs twice, the last one is used.
using Fields = std::map<std::string, std::string, std::less<>>;

std::optional<Fields> parse_fields(std::string_view header) {
  Fields fields;
  ByteReader in(header);
  while (in.left() > 0) {
    const std::string_view field = in.counted();
    const std::size_t equals = field.find('=');
    if (!in.ok() || equals == std::string_view::npos) return std::nullopt;
    fields.insert_or_assign(std::string(field.substr(0, equals)), std::string(field.substr(equals + 1)));
  }
  return fields;
}

template <class T>
std::optional<T> number(const Fields& fields, std::string_view name) {
  const auto field = fields.find(name);
  if (field == fields.end() || field->second.size() != sizeof(T)) return std::nullopt;
  return ByteReader(field->second).number<T>();
}

std::string text(const Fields& fields, std::string_view name) {
  const auto field = fields.find(name);
  return field == fields.end() ? "" : field->second;
}

// Seconds and nanoseconds, 32 bits each, the seconds in the lower ones.
TimeNs time_of(std::uint64_t value) {
  return static_cast<TimeNs>(value & 0xffffffff) * 1'000'000'000 + static_cast<TimeNs>(value >> 32);
}

struct Record {
  unsigned char op = 0;
  Fields fields;
  std::uint64_t data_at = 0, data_size = 0;
  std::uint64_t end() const { return data_at + data_size; }
};

class RosBag1 : public ChunkedFile {
 public:
  explicit RosBag1(InputFile file) : ChunkedFile(std::move(file), "ROS 1 bag") {}

  Status index();

  Result<std::string> read(const MessageRef& message, std::size_t max_bytes) const override {
    const auto record = record_at(message.chunk, message.at);
    const auto conn = record ? number<std::uint32_t>(record->fields, "conn") : std::nullopt;
    if (!record || record->op != kMessage || !conn)
      return Error{path_.string(), "", "no message where the index says", "a message"};
    const auto topic = topic_of_.find(*conn);
    if (topic == topic_of_.end() || topic->second != message.topic)
      return Error{path_.string(), "", "a message of another topic than the index says", "a message of the topic"};
    const std::uint64_t wanted = std::min<std::uint64_t>(record->data_size, max_bytes);
    std::string data = message_bytes(message.chunk, record->data_at, wanted);
    if (data.size() < wanted) return Error{path_.string(), "", "a message that is cut off", "a complete message"};
    return data;
  }

 private:
  // Returns the record at a position in a chunk; nullopt if its header is incomplete. The data may be truncated.
  std::optional<Record> record_at(std::uint32_t chunk, std::uint64_t at) const {
    constexpr std::uint64_t kMostHeaders = 512;
    std::string head = bytes(chunk, at, kMostHeaders);
    const std::uint64_t length = ByteReader(head).number<std::uint32_t>();
    if (head.size() < 8 || length > kMaxHeaderBytes) return std::nullopt;
    if (length + 8 > head.size()) head = bytes(chunk, at, length + 8);
    ByteReader in(head);
    auto fields = parse_fields(in.counted());
    const std::uint64_t size = in.number<std::uint32_t>();
    if (!fields || !in.ok()) return std::nullopt;
    const auto op = number<unsigned char>(*fields, "op");
    if (!op) return std::nullopt;
    return Record{*op, *std::move(fields), at + length + 8, size};
  }

  void read_index_section(const Record& bag_header);
  void add_connection(std::uint32_t chunk, const Record& record);
  bool add_chunk_of(const Record& record);
  bool add_index(const Record& record);
  bool read_record(std::uint64_t at, const Record& record);
  void add_record(std::uint32_t chunk, std::uint64_t at, const Record& record);
  void scan_chunk(std::uint32_t chunk) override;

  std::map<std::uint32_t, std::uint32_t> topic_of_;  // topic index by connection id
  bool has_index_ = false;                           // its connections are known before its chunks
  std::uint64_t expected_chunks_ = 0, unknown_ = 0;
};

void RosBag1::add_connection(std::uint32_t chunk, const Record& record) {
  const auto conn = number<std::uint32_t>(record.fields, "conn");
  if (!conn || topic_of_.contains(*conn) || record.data_size > kMaxDataBytes) return;
  const std::string data = bytes(chunk, record.data_at, record.data_size);
  const auto fields = parse_fields(data);
  if (!fields) return;
  std::string name = text(record.fields, "topic");
  const std::string type = text(*fields, "type");
  if (name.empty()) name = text(*fields, "topic");
  // Several nodes may publish a topic.
  const auto same = std::ranges::find_if(topics_, [&](const Topic& t) { return t.name == name && t.type == type; });
  topic_of_[*conn] = static_cast<std::uint32_t>(same - topics_.begin());
  if (same == topics_.end()) topics_.push_back({name, type, "ros1", Serialisation::kRos1, 0, 0, 0});
}

// Reads the connections and the offsets of the chunks from the index at the end of the bag, whose position is in the
// bag header.
void RosBag1::read_index_section(const Record& bag_header) {
  const auto at = number<std::uint64_t>(bag_header.fields, "index_pos");
  const auto connections = number<std::uint32_t>(bag_header.fields, "conn_count");
  expected_chunks_ = number<std::uint32_t>(bag_header.fields, "chunk_count").value_or(0);
  if (!at || *at == 0) {
    warnings_.push_back(fmt::format(
        "{}: no index, because the recording was not finished; the whole file is read instead", path_.string()));
    return;
  }
  std::uint64_t here = *at;
  while (here < file().size()) {
    const auto record = record_at(0, here);
    if (!record || record->end() > file().size()) break;
    if (record->op == kConnection) add_connection(0, *record);
    const auto chunk = number<std::uint64_t>(record->fields, "chunk_pos");
    if (record->op == kChunkInfo && chunk) chunk_positions_.push_back(*chunk);
    here = record->end();
  }
  std::ranges::sort(chunk_positions_);
  has_index_ = connections && topic_of_.size() >= *connections && here == file().size();
  if (!has_index_)
    warnings_.push_back(fmt::format("{}: damaged or missing index; the whole file is read instead", path_.string()));
}

// Returns false if the chunk has an unknown compression.
bool RosBag1::add_chunk_of(const Record& record) {
  finish_chunk();
  const auto compression = compression_named(text(record.fields, "compression"));
  const auto size = number<std::uint32_t>(record.fields, "size");
  if (!compression || !size) return false;
  const std::uint64_t stored = std::min(record.data_size, file().size() - std::min(file().size(), record.data_at));
  add_chunk({record.data_at, stored, *compression == Compression::kNone ? stored : *size, *compression, 0});
  if (!has_index_ || stored < record.data_size) finish_chunk();
  return true;
}

void RosBag1::add_record(std::uint32_t chunk, std::uint64_t at, const Record& record) {
  const auto topic = topic_of_.find(number<std::uint32_t>(record.fields, "conn").value_or(~0u));
  const auto time = number<std::uint64_t>(record.fields, "time");
  if (topic == topic_of_.end() || !time) {
    ++unknown_;
  } else {
    count_message(topic->second, time_of(*time), chunk, at);
  }
}

void RosBag1::scan_chunk(std::uint32_t chunk) {
  const std::uint64_t end = available(chunk);
  for (std::uint64_t at = 0; at < end;) {
    const auto record = record_at(chunk, at);
    if (!record || record->end() > end) return note_cut_chunk(chunk, at);
    if (record->op == kConnection) add_connection(chunk, *record);
    if (record->op == kMessage) add_record(chunk, at, *record);
    at = record->end();
  }
  if (end < chunks()[chunk].size) note_cut_chunk(chunk, end);
}

// Adds the messages of one connection in the last chunk, unless the chunk was scanned already. Returns false if the
// record is damaged: a field is missing, or the number of entries does not agree with its size.
bool RosBag1::add_index(const Record& record) {
  if (!has_open_chunk()) return true;  // the chunk was scanned
  const auto conn = number<std::uint32_t>(record.fields, "conn");
  const auto count = number<std::uint32_t>(record.fields, "count");
  constexpr std::uint64_t kEntry = 12;
  if (!conn || !count || record.data_size != *count * kEntry || record.data_size > kMaxDataBytes) return false;
  const std::string data = bytes(0, record.data_at, record.data_size);
  const auto topic = topic_of_.find(*conn);
  if (topic == topic_of_.end()) note_damaged_index();  // the connection record may also be in the chunk
  ByteReader in(data);
  for (std::uint32_t k = 0; topic != topic_of_.end() && k < *count && in.left() >= kEntry; ++k) {
    const auto time = in.number<std::uint64_t>();
    add_index_entry(topic->second, time_of(time), in.number<std::uint32_t>());
  }
  return true;
}

// Reads a record outside of chunks. Returns false if it is damaged.
bool RosBag1::read_record(std::uint64_t at, const Record& record) {
  const bool whole = record.end() <= file().size();
  if (record.op == kChunk) return add_chunk_of(record) && whole;  // of a truncated chunk the beginning is read
  if (!whole) return false;
  if (record.op == kBagHeader) read_index_section(record);
  if (record.op == kConnection) add_connection(0, record);
  if (record.op == kMessage) add_record(0, at, record);
  return record.op != kIndex || add_index(record);
}

Status RosBag1::index() {
  constexpr std::uint64_t kFirstRecord = 13;  // after the line "#ROSBAG V2.0"
  if (file().read(0, kFirstRecord) != "#ROSBAG V2.0\n")
    return Error{path_.string(), "", "a bag of another version", "#ROSBAG V2.0"};
  for (std::uint64_t at = kFirstRecord; at < file().size();) {
    const auto record = record_at(0, at);
    if (record && read_record(at, *record)) {
      at = record->end();
      continue;
    }
    note_damaged_index();
    const std::uint64_t next = chunk_after(at);
    note_damage(at, next);
    if (next == 0) break;
    at = next;
  }
  finish_chunk();
  finish_notes(unknown_, expected_chunks_);
  if (topics_.empty()) return Error{path_.string(), "", "no messages", "a bag with messages"};
  return {};
}

}  // namespace

MessageFileResult open_rosbag1(const std::filesystem::path& path) {
  auto file = InputFile::open(path);
  if (!file) return file.error();
  auto bag = std::make_unique<RosBag1>(*std::move(file));
  if (const Status s = bag->index(); !s) return s.error();
  return std::unique_ptr<MessageFile>(std::move(bag));
}

}  // namespace bslam::containers
