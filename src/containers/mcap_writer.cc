#include "containers/mcap_writer.h"

#include <fcntl.h>
#include <libdeflate.h>
#include <unistd.h>
#include <zstd.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cstring>

namespace bslam::containers {
namespace {

constexpr std::string_view kMagic("\x89MCAP0\r\n", 8);
constexpr unsigned char kHeader = 1, kFooter = 2, kSchema = 3, kChannel = 4, kMessage = 5, kChunk = 6,
                        kMessageIndex = 7, kChunkIndex = 8, kAttachment = 9, kAttachmentIndex = 10, kStatistics = 11,
                        kMetadata = 12, kMetadataIndex = 13, kDataEnd = 15;
constexpr std::size_t kChunkBytes = std::size_t{4} << 20;
constexpr int kLevel = 1;  // level of zstd; images are mostly noise, so that higher levels hardly compress better

static_assert(std::endian::native == std::endian::little, "numbers are written as they lie in memory");

template <class T>
void append(std::string& out, T value) {
  char raw[sizeof(T)];
  std::memcpy(raw, &value, sizeof(T));
  out.append(raw, sizeof(T));
}

void append_text(std::string& out, std::string_view text) {
  append(out, static_cast<std::uint32_t>(text.size()));
  out += text;
}

std::string record(unsigned char op, std::string_view data) {
  std::string out(1, static_cast<char>(op));
  append(out, static_cast<std::uint64_t>(data.size()));
  return out += data;
}

// The id of the schema of a topic; 0 means none.
std::uint16_t schema_of(std::size_t topic) { return static_cast<std::uint16_t>(topic + 1); }

std::string compressed(std::string_view bytes) {
  std::string out(ZSTD_compressBound(bytes.size()), '\0');
  const std::size_t size = ZSTD_compress(out.data(), out.size(), bytes.data(), bytes.size(), kLevel);
  out.resize(ZSTD_isError(size) ? 0 : size);
  return out;
}

}  // namespace

Result<std::unique_ptr<McapWriter>> McapWriter::create(const std::filesystem::path& path) {
  FileDescriptor file(::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666));
  if (file.get() < 0) return Error{path.string(), "", std::strerror(errno), "a file that can be written"};
  std::unique_ptr<McapWriter> writer(new McapWriter(path, std::move(file)));
  std::string header;
  append_text(header, "ros2");
  append_text(header, "bslam");
  if (const Status s = writer->put(std::string(kMagic) + record(kHeader, header)); !s) return s.error();
  return writer;
}

McapWriter::~McapWriter() {
  if (file_.get() < 0) return;
  [[maybe_unused]] const Status last = flush();
}

Status McapWriter::put(std::string_view bytes) {
  while (failure_ && !bytes.empty()) {
    const ssize_t written = ::write(file_.get(), bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) {
      failure_ =
          Error{path_.string(), "", written < 0 ? std::strerror(errno) : "a full disk", "room for the recording"};
    } else {
      at_ += static_cast<std::uint64_t>(written);
      bytes.remove_prefix(static_cast<std::size_t>(written));
    }
  }
  return failure_;
}

Status McapWriter::attach(const std::string& name, const std::string& media_type, std::string_view bytes) {
  std::string data(16, '\0');  // times of recording and creation, which are unknown
  append_text(data, name);
  append_text(data, media_type);
  append(data, static_cast<std::uint64_t>(bytes.size()));
  data += bytes;
  append(data, libdeflate_crc32(0, data.data(), data.size()));
  std::string index;
  append(index, at_);
  const std::string whole = record(kAttachment, data);
  append(index, static_cast<std::uint64_t>(whole.size()));
  index += std::string(16, '\0');
  append(index, static_cast<std::uint64_t>(bytes.size()));
  append_text(index, name);
  append_text(index, media_type);
  attachment_indices_ += record(kAttachmentIndex, index);
  ++attachments_;
  return put(whole);
}

Status McapWriter::add_metadata(const std::string& name, const std::map<std::string, std::string>& values) {
  std::string pairs, data;
  for (const auto& [key, value] : values) {
    append_text(pairs, key);
    append_text(pairs, value);
  }
  append_text(data, name);
  append_text(data, pairs);
  const std::string whole = record(kMetadata, data);
  std::string index;
  append(index, at_);
  append(index, static_cast<std::uint64_t>(whole.size()));
  append_text(index, name);
  metadata_indices_ += record(kMetadataIndex, index);
  ++metadata_;
  return put(whole);
}

std::uint16_t McapWriter::add_topic(const std::string& name, const std::string& type, const std::string& definition) {
  channels_.push_back({name, type, definition});
  return static_cast<std::uint16_t>(channels_.size() - 1);
}

// The schema record of a topic. Every topic has its own schema.
std::string McapWriter::schema_record(std::size_t number) const {
  std::string out;
  append(out, schema_of(number));
  append_text(out, channels_[number].type);
  append_text(out, "ros2msg");
  append_text(out, channels_[number].definition);
  return record(kSchema, out);
}

std::string McapWriter::channel_record(std::size_t number) const {
  std::string out;
  append(out, static_cast<std::uint16_t>(number));
  append(out, schema_of(number));
  append_text(out, channels_[number].name);
  append_text(out, "cdr");
  append_text(out, "");  // no metadata
  return record(kChannel, out);
}

Status McapWriter::write(std::uint16_t topic, TimeNs time_ns, std::string_view message) {
  if (time_ns < 0 && failure_)
    failure_ = Error{path_.string(), "", "a time before 1970", "times from 1970 on, as MCAP files contain them"};
  if (!failure_) return failure_;
  const auto time = static_cast<std::uint64_t>(time_ns);
  for (; described_ < channels_.size(); ++described_)
    chunk_.records += schema_record(described_) + channel_record(described_);
  Channel& channel = channels_.at(topic);
  chunk_.first_ns = chunk_.index.empty() ? time : std::min(chunk_.first_ns, time);
  chunk_.last_ns = std::max(chunk_.last_ns, time);
  std::string& entries = chunk_.index[topic];
  append(entries, time);
  append(entries, static_cast<std::uint64_t>(chunk_.records.size()));
  std::string head;
  append(head, topic);
  append(head, static_cast<std::uint32_t>(channel.messages++));
  append(head, time);
  append(head, time);
  chunk_.records += static_cast<char>(kMessage);
  append(chunk_.records, static_cast<std::uint64_t>(head.size() + message.size()));
  chunk_.records += head;
  chunk_.records += message;
  return chunk_.records.size() < kChunkBytes ? failure_ : flush();
}

Status McapWriter::flush() {
  if (chunk_.index.empty() || !failure_) return failure_;
  const Chunk chunk = std::exchange(chunk_, {});
  std::string stored = compressed(chunk.records);
  const std::string_view compression = stored.empty() ? "" : "zstd";
  if (stored.empty()) stored = chunk.records;
  std::string data;
  append(data, chunk.first_ns);
  append(data, chunk.last_ns);
  append(data, static_cast<std::uint64_t>(chunk.records.size()));
  append(data, libdeflate_crc32(0, chunk.records.data(), chunk.records.size()));
  append_text(data, compression);
  append(data, static_cast<std::uint64_t>(stored.size()));
  data += stored;
  const std::uint64_t chunk_at = at_;
  std::string whole = record(kChunk, data), offsets, index_records;
  const std::uint64_t chunk_size = whole.size();
  for (const auto& [topic, entries] : chunk.index) {
    append(offsets, topic);
    append(offsets, chunk_at + chunk_size + index_records.size());
    std::string index;
    append(index, topic);
    append_text(index, entries);
    index_records += record(kMessageIndex, index);
  }
  std::string index;
  append(index, chunk.first_ns);
  append(index, chunk.last_ns);
  append(index, chunk_at);
  append(index, chunk_size);
  append_text(index, offsets);
  append(index, static_cast<std::uint64_t>(index_records.size()));
  append_text(index, compression);
  append(index, static_cast<std::uint64_t>(stored.size()));
  append(index, static_cast<std::uint64_t>(chunk.records.size()));
  chunk_indices_ += record(kChunkIndex, index);
  first_ns_ = chunks_++ == 0 ? chunk.first_ns : std::min(first_ns_, chunk.first_ns);
  last_ns_ = std::max(last_ns_, chunk.last_ns);
  return put(whole + index_records);
}

std::string McapWriter::statistics() const {
  std::uint64_t all = 0;
  std::string counts, out;
  for (std::size_t k = 0; k < channels_.size(); ++k) {
    all += channels_[k].messages;
    append(counts, static_cast<std::uint16_t>(k));
    append(counts, channels_[k].messages);
  }
  append(out, all);
  append(out, static_cast<std::uint16_t>(channels_.size()));
  append(out, static_cast<std::uint32_t>(channels_.size()));
  for (const std::uint32_t count : {attachments_, metadata_, chunks_}) append(out, count);
  append(out, first_ns_);
  append(out, last_ns_);
  append_text(out, counts);
  return record(kStatistics, out);
}

Status McapWriter::finish() {
  if (const Status s = flush(); !s) return s;
  std::string end(4, '\0');  // no checksum of the data
  if (const Status s = put(record(kDataEnd, end)); !s) return s;
  const std::uint64_t summary_at = at_;
  std::string summary;  // records of one kind follow each other, as the specification demands
  for (std::size_t k = 0; k < described_; ++k) summary += schema_record(k);
  for (std::size_t k = 0; k < described_; ++k) summary += channel_record(k);
  summary += chunk_indices_ + attachment_indices_ + metadata_indices_ + statistics();
  std::string footer;
  append(footer, summary_at);
  append(footer, std::uint64_t{0});  // no offsets of the parts of the summary
  append(footer, std::uint32_t{0});  // no checksum
  const Status written = put(summary + record(kFooter, footer) + std::string(kMagic));
  const bool closed = file_.close();
  if (written && !closed) return Error{path_.string(), "", std::strerror(errno), "room for the recording"};
  return written;
}

}  // namespace bslam::containers
