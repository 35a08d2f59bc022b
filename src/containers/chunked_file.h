// Common base of ROS 1 bags and MCAP files: messages in chunks, which may be compressed. Internal to this folder.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "containers/compression.h"
#include "containers/input_file.h"
#include "containers/message_file.h"

namespace bslam::containers {

struct Chunk {
  std::uint64_t at = 0;           // position of its data in the file
  std::uint64_t stored_size = 0;  // bytes of it in the file; fewer if the file is truncated
  std::uint64_t size = 0;         // bytes after decompression, according to the file
  Compression compression = Compression::kNone;
  std::uint32_t checksum = 0;  // CRC-32 of the decompressed data; 0: none
};

class ChunkedFile : public MessageFile {
 protected:
  // Chunk 0 is the whole file, for messages outside of chunks.
  ChunkedFile(InputFile file, std::string format);

  const InputFile& file() const { return file_; }
  const std::vector<Chunk>& chunks() const { return chunks_; }
  // Adds a chunk. Its messages are those of its index, which follows it, or are found by scan_chunk in finish_chunk.
  void add_chunk(const Chunk& chunk);
  // Returns true from add_chunk to finish_chunk.
  bool has_open_chunk() const { return open_; }
  // Stores a message listed by the index of the open chunk.
  void add_index_entry(std::uint32_t topic, TimeNs received_ns, std::uint64_t at);
  // The index of the open chunk, if there is one, is damaged or incomplete: the chunk will be scanned.
  void note_damaged_index() { index_damaged_ = true; }
  // Counts the messages of the open chunk, if there is one: those of its index, or all that are found in it if the
  // index is missing or damaged.
  void finish_chunk();
  // Finds the messages of a chunk in its data.
  virtual void scan_chunk(std::uint32_t chunk) = 0;

  // Up to `count` bytes of the decompressed chunk from position `at`.
  std::string bytes(std::uint32_t chunk, std::uint64_t at, std::uint64_t count) const;
  // The same for the data of a message; none if the chunk does not contain all of it, or it is larger than
  // kMaxMessageBytes: the length in a damaged file reserves no memory.
  std::string message_bytes(std::uint32_t chunk, std::uint64_t at, std::uint64_t count) const;
  // Number of bytes of the decompressed chunk that can be read.
  std::uint64_t available(std::uint32_t chunk) const;
  // Returns false if the chunk has a checksum that differs from that of its data.
  bool checksum_holds(std::uint32_t chunk) const;

  // Positions of chunks according to the index of the file; used to continue after damaged parts of the file.
  std::vector<std::uint64_t> chunk_positions_;

  // Returns the position of the first chunk after `at` that the index names, or 0.
  std::uint64_t chunk_after(std::uint64_t at) const;
  // Notes that the file is damaged at `at`, and that reading continues at `next` (0: reading ends).
  void note_damage(std::uint64_t at, std::uint64_t next);
  // Notes that only the first bytes of a chunk could be read.
  void note_cut_chunk(std::uint32_t chunk, std::uint64_t good_bytes);
  // Turns the notes into warnings: of each kind the first, and how many there are. Warns as well of messages that
  // belong to no topic, and if there are fewer chunks than the index lists.
  void finish_notes(std::uint64_t unknown_messages, std::uint64_t expected_chunks);

 private:
  struct Loaded {
    std::uint32_t chunk = 0;
    bool checksum_holds = true;
    std::shared_ptr<const std::string> data;
  };
  // The decompressed chunk, which is kept for a while.
  Loaded load(std::uint32_t chunk) const;

  struct IndexEntry {
    std::uint32_t topic = 0;
    TimeNs received_ns = 0;
    std::uint64_t at = 0;
  };

  struct Notes {
    std::string first;
    std::uint64_t count = 0;
  };

  InputFile file_;
  std::vector<Chunk> chunks_;
  bool open_ = false, index_damaged_ = false;  // state of the last chunk
  std::vector<IndexEntry> entries_;
  Notes damaged_, cut_;
  mutable std::mutex mutex_;
  mutable std::vector<Loaded> cache_;  // the last used one at the end
};

}  // namespace bslam::containers
