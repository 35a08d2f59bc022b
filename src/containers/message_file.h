// Files of time-stamped messages in topics: ROS 1 bags, ROS 2 bags (sqlite3) and MCAP files.
#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "base/timestamp.h"

namespace bslam::containers {

enum class Serialisation { kRos1, kCdr, kProtobuf, kOther };

struct Topic {
  std::string name;
  std::string type;           // such as sensor_msgs/Image; without the "/msg" of ROS 2
  std::string serialisation;  // its name in the file, such as cdr
  Serialisation parsed_as = Serialisation::kOther;
  std::uint64_t count = 0;           // number of messages
  TimeNs first_ns = 0, last_ns = 0;  // times at which the first and last message were recorded
};

// Where a message is in its file.
struct MessageRef {
  TimeNs received_ns = 0;   // time at which it was recorded
  std::uint64_t at = 0;     // position in the file, or in the decompressed chunk, or row of the table
  std::uint32_t chunk = 0;  // number of the chunk
  std::uint32_t topic = 0;  // index into topics()
};

// A file within a file, such as the calibration beside its images.
struct Attachment {
  std::string name, bytes;
};

constexpr std::size_t kWholeMessage = std::numeric_limits<std::size_t>::max();
constexpr std::size_t kMaxMessageBytes = std::size_t{1} << 30;  // larger ones are damaged

// An open file: its topics, and the positions of the messages with images and calibrations. Messages are read on
// request.
class MessageFile {
 public:
  virtual ~MessageFile() = default;

  const std::filesystem::path& path() const { return path_; }
  std::string_view format() const { return format_; }  // for the user, such as "ROS 1 bag"
  const std::vector<Topic>& topics() const { return topics_; }
  // The messages of topics with a type for which is_needed is true, in the order of the file.
  const std::vector<MessageRef>& messages() const { return messages_; }
  // Small attachments, and metadata by name and key. MCAP files only.
  const std::vector<Attachment>& attachments() const { return attachments_; }
  const std::map<std::string, std::map<std::string, std::string>>& metadata() const { return metadata_; }
  // For the user: what is damaged or missing, with counts.
  const std::vector<std::string>& warnings() const { return warnings_; }

  // Returns the serialised message, or its first bytes up to `max_bytes` or somewhat more. A whole message is tested
  // against the checksum of its chunk, if it has one. May be called from several threads. Errors: the message is
  // damaged or truncated.
  virtual Result<std::string> read(const MessageRef& message, std::size_t max_bytes) const = 0;

 protected:
  // Counts a message of a topic, and keeps its place if the topic is needed.
  void count_message(std::uint32_t topic, TimeNs received_ns, std::uint32_t chunk, std::uint64_t at);

  // Recorders of ROS 2 can compress messages one by one with zstd. Returns true if a message begins as a compressed
  // one.
  static bool is_compressed_message(std::string_view bytes);
  // Returns up to `max_bytes` of a compressed message; an empty string if it is damaged.
  static std::string decompressed_message(std::string_view whole, std::size_t max_bytes);

  std::filesystem::path path_;
  std::string format_;
  std::vector<Topic> topics_;
  std::vector<MessageRef> messages_;
  std::vector<Attachment> attachments_;
  std::map<std::string, std::map<std::string, std::string>> metadata_;
  std::vector<std::string> warnings_;
};

using MessageFileResult = Result<std::unique_ptr<MessageFile>>;

// Recognises the format by the first bytes. Errors: the file cannot be read; another format; no topic can be read.
MessageFileResult open_message_file(const std::filesystem::path& path);

// Returns an attachment of an MCAP file, of any size up to 64 MB. Reads only the file's records up to there. Errors:
// the file cannot be read or is no MCAP file; it has no such attachment, or a damaged one.
Result<std::string> read_attachment(const std::filesystem::path& file, std::string_view name);

// Returns true if the name of the file ends as those of message files do: .bag, .db3 or .mcap.
bool has_message_file_name(const std::filesystem::path& path);

// Returns true for the types of images and calibrations, which are indexed.
bool is_needed(std::string_view type);

// Returns "package/Name" for "package/msg/Name" and "package.Name".
std::string plain_type(std::string_view type);

// One function per format; the errors are those of open_message_file.
MessageFileResult open_rosbag1(const std::filesystem::path& path);
MessageFileResult open_mcap(const std::filesystem::path& path);
MessageFileResult open_sqlite_bag(const std::filesystem::path& path);

}  // namespace bslam::containers
