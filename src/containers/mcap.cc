// MCAP files consist of records: an opcode, a 64-bit length and data. A file is read record by record from its
// beginning, so that a truncated file is read in the same way. The data of a chunk is skipped if an index of its
// messages follows.
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "base/byte_reader.h"
#include "containers/chunked_file.h"

namespace bslam::containers {
namespace {

constexpr std::string_view kMagic("\x89MCAP0\r\n", 8);
constexpr std::uint64_t kHead = 9;  // bytes of opcode and length
constexpr std::uint64_t kMaxDataBytes = std::uint64_t{1} << 26;
constexpr unsigned char kFooter = 2, kSchema = 3, kChannel = 4, kMessage = 5, kChunkRecord = 6, kMessageIndex = 7,
                        kChunkIndex = 8, kAttachmentRecord = 9, kMetadata = 12, kDataEnd = 15;
constexpr std::uint64_t kMaxAttachmentBytes = std::uint64_t{1} << 20;  // larger ones are not kept
constexpr std::size_t kMaxAttachments = 16;

struct Record {
  unsigned char op = 0;
  std::uint64_t data_at = 0, data_size = 0;
  std::uint64_t end() const { return data_at + data_size; }
};

std::optional<Record> parse_head(std::string_view head, std::uint64_t at) {
  if (head.size() < kHead) return std::nullopt;
  ByteReader in(head);
  Record record{in.number<unsigned char>(), at + kHead, 0};
  record.data_size = in.number<std::uint64_t>();
  if (record.op == 0 || record.data_size > std::uint64_t{1} << 62) return std::nullopt;
  return record;
}

std::optional<Attachment> parse_attachment(std::string_view data) {
  ByteReader in(data);
  in.skip(16);  // the times of recording and creation
  const std::string_view name = in.counted();
  in.counted();  // its type
  const auto size = in.number<std::uint64_t>();
  if (!in.ok() || size > in.left()) return std::nullopt;
  const std::string_view bytes = in.take(static_cast<std::size_t>(size));
  return Attachment{std::string(name), std::string(bytes)};
}

Serialisation serialisation_named(std::string_view name) {
  if (name == "ros1") return Serialisation::kRos1;
  if (name == "cdr") return Serialisation::kCdr;
  return name == "protobuf" ? Serialisation::kProtobuf : Serialisation::kOther;
}

class McapFile : public ChunkedFile {
 public:
  explicit McapFile(InputFile file) : ChunkedFile(std::move(file), "MCAP") {}

  Status index();

  Result<std::string> read(const MessageRef& message, std::size_t max_bytes) const override {
    const auto record = record_at(message.chunk, message.at);
    const std::string head = record ? bytes(message.chunk, record->data_at, kMessageHead) : "";
    if (!record || record->op != kMessage || head.size() < kMessageHead || record->data_size < kMessageHead)
      return Error{path_.string(), "", "no message where the index says", "a message"};
    const auto topic = topic_of_.find(ByteReader(head).number<std::uint16_t>());
    if (topic == topic_of_.end() || topic->second != message.topic)
      return Error{path_.string(), "", "a message of another topic than the index says", "a message of the topic"};
    if (max_bytes == kWholeMessage && !checksum_holds(message.chunk)) {
      return Error{path_.string(), fmt::format("chunk at byte {}", chunks()[message.chunk].at),
                   "data with another checksum", "the stored checksum"};
    }
    const std::uint64_t size = record->data_size - kMessageHead;
    const auto part = [&](std::uint64_t count) {
      return message_bytes(message.chunk, record->data_at + kMessageHead, count);
    };
    const std::uint64_t wanted = std::min<std::uint64_t>(size, max_bytes);
    std::string data = part(wanted);
    const bool packed = is_compressed_message(data);
    if (packed && wanted < size) data = part(size);
    if (data.size() < (packed ? size : wanted)) return cut_off();
    if (packed) data = decompressed_message(data, max_bytes);
    return packed && data.empty() ? cut_off() : Result<std::string>(std::move(data));
  }

 private:
  Error cut_off() const { return {path_.string(), "", "a message that is damaged or cut off", "a complete message"}; }

  static constexpr std::uint64_t kMessageHead = 22;  // channel, sequence, time of logging, time of publication

  std::optional<Record> record_at(std::uint32_t chunk, std::uint64_t at) const {
    return parse_head(bytes(chunk, at, kHead), at);
  }
  // Returns the data of a record; empty if it is truncated or larger than kMaxDataBytes.
  std::string data_of(std::uint32_t chunk, const Record& record) const {
    if (record.data_size > kMaxDataBytes) return {};
    std::string data = bytes(chunk, record.data_at, record.data_size);
    return data.size() == record.data_size ? data : std::string();
  }

  void read_summary();
  void add_schema(std::string_view data);
  void add_channel(std::string_view data);
  void add_attachment(std::string_view data);
  void add_metadata(std::string_view data);
  void add_record(std::uint32_t chunk, std::uint64_t at, const Record& record);
  bool add_chunk_of(const Record& record);
  bool add_index(const Record& record);
  void scan_chunk(std::uint32_t chunk) override;
  bool read_record(std::uint64_t at, const Record& record);

  std::map<std::uint16_t, std::string> schemas_;     // names by schema id
  std::map<std::uint16_t, std::uint32_t> topic_of_;  // topic index by channel id
  bool has_summary_ = false;
  std::uint64_t unknown_ = 0;
};

void McapFile::add_schema(std::string_view data) {
  ByteReader in(data);
  const auto id = in.number<std::uint16_t>();
  const std::string_view name = in.counted();
  if (in.ok()) schemas_.emplace(id, name);
}

void McapFile::add_channel(std::string_view data) {
  ByteReader in(data);
  const auto id = in.number<std::uint16_t>(), schema = in.number<std::uint16_t>();
  const std::string name(in.counted()), encoding(in.counted());
  if (!in.ok() || topic_of_.contains(id)) return;
  const auto type = schemas_.find(schema);
  const Topic topic{name, type == schemas_.end() ? "" : plain_type(type->second), encoding,
                    serialisation_named(encoding)};
  const auto same = std::ranges::find_if(topics_, [&](const Topic& t) {
    return t.name == topic.name && t.type == topic.type && t.serialisation == topic.serialisation;
  });
  topic_of_[id] = static_cast<std::uint32_t>(same - topics_.begin());
  if (same == topics_.end()) topics_.push_back(topic);
}

void McapFile::add_attachment(std::string_view data) {
  auto attachment = parse_attachment(data);
  if (attachment && attachments_.size() < kMaxAttachments) attachments_.push_back(*std::move(attachment));
}

void McapFile::add_metadata(std::string_view data) {
  ByteReader in(data);
  const std::string name(in.counted());
  ByteReader pairs(in.counted());
  if (!in.ok() || metadata_.size() >= kMaxAttachments) return;
  auto& values = metadata_[name];
  while (pairs.left() > 0) {
    const std::string key(pairs.counted());
    const std::string_view value = pairs.counted();
    if (!pairs.ok()) return;
    values.emplace(key, value);
  }
}

// Reads the channels and the offsets of the chunks from the summary section at the end of the file.
void McapFile::read_summary() {
  constexpr std::uint64_t kFooterSize = kHead + 20, kEnd = kFooterSize + kMagic.size();
  const std::uint64_t size = file().size();
  if (size < kMagic.size() + kEnd || file().read(size - kMagic.size(), kMagic.size()) != kMagic) {
    warnings_.push_back(fmt::format(
        "{}: no index, because the recording was not finished; the whole file is read instead", path_.string()));
    return;
  }
  const auto footer = record_at(0, size - kEnd);
  std::uint64_t at = footer && footer->op == kFooter ? ByteReader(data_of(0, *footer)).number<std::uint64_t>() : 0;
  if (at == 0) return;  // files may have no summary
  while (at < size - kEnd) {
    const auto record = record_at(0, at);
    if (!record || record->end() > size - kEnd) break;
    if (record->op == kSchema) add_schema(data_of(0, *record));
    if (record->op == kChannel) add_channel(data_of(0, *record));
    if (record->op == kChunkIndex) {
      const std::string data = data_of(0, *record);
      ByteReader in(data);
      in.skip(16);  // the times of the first and last message
      const auto position = in.number<std::uint64_t>();
      if (in.ok()) chunk_positions_.push_back(position);
    }
    at = record->end();
  }
  std::ranges::sort(chunk_positions_);
  has_summary_ = at == size - kEnd && !topic_of_.empty();
  if (at != size - kEnd)
    warnings_.push_back(fmt::format("{}: damaged index; the whole file is read instead", path_.string()));
}

void McapFile::add_record(std::uint32_t chunk, std::uint64_t at, const Record& record) {
  if (record.op == kSchema) add_schema(data_of(chunk, record));
  if (record.op == kChannel) add_channel(data_of(chunk, record));
  if (record.op != kMessage) return;
  const std::string head = bytes(chunk, record.data_at, kMessageHead);
  ByteReader in(head);
  const auto topic = topic_of_.find(in.number<std::uint16_t>());
  in.skip(4);
  const auto time = in.number<std::uint64_t>();
  if (!in.ok() || topic == topic_of_.end()) {
    ++unknown_;
  } else {
    count_message(topic->second, static_cast<TimeNs>(time & ~(std::uint64_t{1} << 63)), chunk, at);
  }
}

// Adds a chunk. Returns false if it has an unknown compression or a damaged header.
bool McapFile::add_chunk_of(const Record& record) {
  finish_chunk();
  constexpr std::uint64_t kMostHeader = 256;
  const std::string head = bytes(0, record.data_at, std::min(kMostHeader, record.data_size));
  ByteReader in(head);
  in.skip(16);  // the times of the first and last message
  const auto size = in.number<std::uint64_t>();
  const auto checksum = in.number<std::uint32_t>();
  const auto compression = compression_named(in.counted());
  const auto stored = in.number<std::uint64_t>();
  const std::uint64_t at = record.data_at + in.position();
  if (!in.ok() || !compression || stored > record.data_size) return false;
  const std::uint64_t there = std::min(stored, file().size() - std::min(file().size(), at));
  add_chunk({at, there, size, *compression, checksum});
  if (!has_summary_ || there < stored) finish_chunk();
  return true;
}

void McapFile::scan_chunk(std::uint32_t chunk) {
  const std::uint64_t end = available(chunk);
  for (std::uint64_t at = 0; at < end;) {
    const auto record = record_at(chunk, at);
    if (!record || record->end() > end) return note_cut_chunk(chunk, at);
    add_record(chunk, at, *record);
    at = record->end();
  }
  if (end < chunks()[chunk].size) note_cut_chunk(chunk, end);
}

// Adds the messages of one channel in the last chunk. Returns false if the record is damaged.
bool McapFile::add_index(const Record& record) {
  if (!has_open_chunk()) return true;  // the messages of the chunk were found by scanning it
  const std::string data = data_of(0, record);
  ByteReader in(data);
  const auto channel = in.number<std::uint16_t>();
  constexpr std::uint32_t kEntry = 16;
  const std::uint32_t count = in.number<std::uint32_t>() / kEntry;
  if (!in.ok() || in.left() < std::uint64_t{count} * kEntry) return false;
  const auto topic = topic_of_.find(channel);
  if (topic == topic_of_.end()) note_damaged_index();  // the channel record may also be in the chunk
  for (std::uint32_t k = 0; topic != topic_of_.end() && k < count; ++k) {
    const auto time = in.number<std::uint64_t>() & ~(std::uint64_t{1} << 63);
    add_index_entry(topic->second, static_cast<TimeNs>(time), in.number<std::uint64_t>());
  }
  return true;
}

// Reads a record outside of chunks. Returns false if it is damaged.
bool McapFile::read_record(std::uint64_t at, const Record& record) {
  const bool whole = record.end() <= file().size();
  if (record.op == kChunkRecord) return add_chunk_of(record) && whole;  // of a truncated chunk the beginning is read
  if (!whole) return false;
  if (record.op == kMessageIndex) return add_index(record);
  const bool small = record.data_size <= kMaxAttachmentBytes;
  if (record.op == kAttachmentRecord && small) add_attachment(data_of(0, record));
  if (record.op == kMetadata && small) add_metadata(data_of(0, record));
  add_record(0, at, record);
  return true;
}

Status McapFile::index() {
  if (file().read(0, kMagic.size()) != kMagic)
    return Error{path_.string(), "", "an MCAP file of another version", "MCAP0"};
  read_summary();
  for (std::uint64_t at = kMagic.size(); at < file().size();) {
    const auto record = record_at(0, at);
    if (record && (record->op == kDataEnd || record->op == kFooter)) break;
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
  finish_notes(unknown_, chunk_positions_.size());
  if (topics_.empty()) return Error{path_.string(), "", "no messages", "an MCAP file with messages"};
  return {};
}

}  // namespace

Result<std::string> read_attachment(const std::filesystem::path& file, std::string_view name) {
  const auto mcap = InputFile::open(file);
  if (!mcap) return mcap.error();
  if (mcap->read(0, kMagic.size()) != kMagic) return Error{file.string(), "", "another format", "an MCAP file"};
  for (std::uint64_t at = kMagic.size(); at < mcap->size();) {
    const auto record = parse_head(mcap->read(at, kHead), at);
    if (!record || record->op == kDataEnd || record->op == kFooter) break;
    at = record->end();
    if (record->op != kAttachmentRecord || record->data_size > kMaxDataBytes || at > mcap->size()) continue;
    auto attachment = parse_attachment(mcap->read(record->data_at, record->data_size));
    if (attachment && attachment->name == name) return std::move(attachment->bytes);
  }
  return Error{file.string(), "", fmt::format("no attachment {}", name), "a recording that contains it"};
}

MessageFileResult open_mcap(const std::filesystem::path& path) {
  auto file = InputFile::open(path);
  if (!file) return file.error();
  auto mcap = std::make_unique<McapFile>(*std::move(file));
  if (const Status s = mcap->index(); !s) return s.error();
  return std::unique_ptr<MessageFile>(std::move(mcap));
}

}  // namespace bslam::containers
