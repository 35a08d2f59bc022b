#include "containers/chunked_file.h"

#include <fmt/format.h>
#include <libdeflate.h>

#include <algorithm>
#include <utility>

namespace bslam::containers {
namespace {

constexpr std::size_t kMaxChunkBytes = std::size_t{1} << 30;  // after decompression; recorders write a few MB
constexpr std::size_t kCachedChunks = 4, kCachedBytes = std::size_t{1} << 26;

}  // namespace

ChunkedFile::ChunkedFile(InputFile file, std::string format) : file_(std::move(file)) {
  path_ = file_.path();
  format_ = std::move(format);
  chunks_.push_back({0, file_.size(), file_.size(), Compression::kNone, 0});
}

void ChunkedFile::add_chunk(const Chunk& chunk) {
  finish_chunk();
  chunks_.push_back(chunk);
  open_ = true;
  index_damaged_ = false;
}

void ChunkedFile::add_index_entry(std::uint32_t topic, TimeNs received_ns, std::uint64_t at) {
  entries_.push_back({topic, received_ns, at});
}

void ChunkedFile::finish_chunk() {
  if (!open_) return;
  open_ = false;
  const std::vector<IndexEntry> entries = std::exchange(entries_, {});
  const auto chunk = static_cast<std::uint32_t>(chunks_.size() - 1);
  if (entries.empty() || index_damaged_) return scan_chunk(chunk);
  for (const IndexEntry& entry : entries) count_message(entry.topic, entry.received_ns, chunk, entry.at);
}

ChunkedFile::Loaded ChunkedFile::load(std::uint32_t index) const {
  {
    const std::lock_guard lock(mutex_);
    const auto found = std::ranges::find(cache_, index, &Loaded::chunk);
    if (found != cache_.end()) {
      std::rotate(found, found + 1, cache_.end());
      return cache_.back();
    }
  }
  const Chunk& chunk = chunks_.at(index);
  std::string data = file_.read(chunk.at, std::min<std::uint64_t>(chunk.stored_size, kMaxChunkBytes));
  if (chunk.compression != Compression::kNone) {
    data = decompress(chunk.compression, data,
                      static_cast<std::size_t>(std::min<std::uint64_t>(chunk.size, kMaxChunkBytes)));
  }
  const bool holds = chunk.checksum == 0 || libdeflate_crc32(0, data.data(), data.size()) == chunk.checksum;
  Loaded loaded{index, holds, std::make_shared<const std::string>(std::move(data))};
  const std::lock_guard lock(mutex_);
  cache_.push_back(loaded);
  std::size_t total = 0;
  for (const Loaded& other : cache_) total += other.data->size();
  while (cache_.size() > 1 && (cache_.size() > kCachedChunks || total > kCachedBytes)) {
    total -= cache_.front().data->size();
    cache_.erase(cache_.begin());
  }
  return loaded;
}

std::string ChunkedFile::bytes(std::uint32_t index, std::uint64_t at, std::uint64_t count) const {
  const Chunk& chunk = chunks_.at(index);
  if (chunk.compression == Compression::kNone) {
    if (at >= chunk.stored_size) return {};
    return file_.read(chunk.at + at, std::min(count, chunk.stored_size - at));
  }
  const Loaded loaded = load(index);
  if (at >= loaded.data->size()) return {};
  return loaded.data->substr(static_cast<std::size_t>(at),
                             static_cast<std::size_t>(std::min<std::uint64_t>(count, loaded.data->size())));
}

std::string ChunkedFile::message_bytes(std::uint32_t index, std::uint64_t at, std::uint64_t count) const {
  const std::uint64_t there = available(index);
  if (count > kMaxMessageBytes || at > there || count > there - at) return {};
  return bytes(index, at, count);
}

std::uint64_t ChunkedFile::available(std::uint32_t index) const {
  const Chunk& chunk = chunks_.at(index);
  return chunk.compression == Compression::kNone ? chunk.stored_size : load(index).data->size();
}

bool ChunkedFile::checksum_holds(std::uint32_t index) const {
  const Chunk& chunk = chunks_.at(index);
  // Chunks that do not fit into the cache would be read once for every message.
  if (chunk.checksum == 0 || chunk.stored_size > kCachedBytes) return true;
  return load(index).checksum_holds;
}

std::uint64_t ChunkedFile::chunk_after(std::uint64_t at) const {
  const auto next = std::ranges::upper_bound(chunk_positions_, at);
  return next == chunk_positions_.end() || *next >= file_.size() ? 0 : *next;
}

void ChunkedFile::note_damage(std::uint64_t at, std::uint64_t next) {
  if (damaged_.count++ > 0) return;
  damaged_.first = next != 0
                       ? fmt::format("damaged at byte {}; {} bytes are not read", at, next - at)
                       : fmt::format("damaged or cut off at byte {} of {}; the rest is not read", at, file_.size());
}

void ChunkedFile::note_cut_chunk(std::uint32_t chunk, std::uint64_t good_bytes) {
  if (cut_.count++ > 0) return;
  cut_.first = fmt::format("the chunk at byte {} is damaged or cut off after {} of {} bytes", chunks_.at(chunk).at,
                           good_bytes, chunks_.at(chunk).size);
}

void ChunkedFile::finish_notes(std::uint64_t unknown_messages, std::uint64_t expected_chunks) {
  for (const Notes& notes : {damaged_, cut_}) {
    if (notes.count == 0) continue;
    warnings_.push_back(fmt::format("{}: {}{}", path_.string(), notes.first,
                                    notes.count > 1 ? fmt::format(", and {} more such places", notes.count - 1) : ""));
  }
  if (unknown_messages > 0)
    warnings_.push_back(
        fmt::format("{}: {} messages of unknown topics are not used", path_.string(), unknown_messages));
  const std::size_t found = chunks_.size() - 1;  // the first is the whole file
  if (found < expected_chunks)
    warnings_.push_back(fmt::format("{}: {} of {} chunks can be read", path_.string(), found, expected_chunks));
}

}  // namespace bslam::containers
