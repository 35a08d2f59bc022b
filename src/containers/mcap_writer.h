// Writes MCAP files so that all but the last moment of a recording can be read if the program ends at any time:
// messages are collected in chunks of at most a few MB, which follow each other in the file, and the index comes at the
// end.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/file_descriptor.h"
#include "base/result.h"
#include "base/timestamp.h"

namespace bslam::containers {

class McapWriter {
 public:
  // Creates the file, or replaces it. Error: it cannot be written.
  static Result<std::unique_ptr<McapWriter>> create(const std::filesystem::path& path);
  // The file of a writer that was not finished ends without an index.
  ~McapWriter();
  McapWriter(const McapWriter&) = delete;
  McapWriter& operator=(const McapWriter&) = delete;

  // Adds a file, or names with values, before the first message. Errors: those of flush.
  Status attach(const std::string& name, const std::string& media_type, std::string_view bytes);
  Status add_metadata(const std::string& name, const std::map<std::string, std::string>& values);

  // Adds a topic of ROS 2 messages, `type` such as sensor_msgs/msg/Image with its definition, and returns its number.
  std::uint16_t add_topic(const std::string& name, const std::string& type, const std::string& definition);

  // Adds a message, which was recorded at `time_ns`, to the chunk, and writes the chunk when it is full. Errors: as of
  // flush; a time before 1970, which the format cannot represent.
  Status write(std::uint16_t topic, TimeNs time_ns, std::string_view message);
  // Writes the chunk. Error: the disk is full or broken. All later calls return it as well and write nothing, so that
  // the file remains readable up to there.
  Status flush();
  // Writes chunk and index. No call may follow.
  Status finish();

  std::uint64_t bytes() const { return at_; }  // bytes written so far

 private:
  struct Channel {
    std::string name, type, definition;
    std::uint64_t messages = 0;
  };
  struct Chunk {
    std::string records;
    std::map<std::uint16_t, std::string> index;  // entries of the messages of a topic
    std::uint64_t first_ns = 0, last_ns = 0;     // times of its messages
  };

  McapWriter(std::filesystem::path path, FileDescriptor file) : path_(std::move(path)), file_(std::move(file)) {}
  Status put(std::string_view bytes);
  std::string schema_record(std::size_t number) const;
  std::string channel_record(std::size_t number) const;
  std::string statistics() const;

  const std::filesystem::path path_;
  FileDescriptor file_;
  std::uint64_t at_ = 0;
  Status failure_;
  std::vector<Channel> channels_;
  std::size_t described_ = 0;  // channels whose records are in a chunk
  Chunk chunk_;
  std::string chunk_indices_, attachment_indices_, metadata_indices_;  // records for the summary
  std::uint32_t chunks_ = 0, attachments_ = 0, metadata_ = 0;
  std::uint64_t first_ns_ = 0, last_ns_ = 0;  // times of all messages
};

}  // namespace bslam::containers
