// The images of topics in bags and MCAP files: where they are, when they were taken, and their pixels.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "base/timestamp.h"
#include "containers/message_file.h"
#include "containers/messages.h"
#include "image_files/image_store.h"

namespace bslam::dataset {

// One image of a topic, described by the beginning of its message.
struct BagImage {
  TimeNs stamp_ns = 0;  // time stamp of the header; 0: not set
  TimeNs received_ns = 0;
  std::int64_t entry = 0;  // its index in the store
};

// A topic of images of a recording, which may be spread over several files.
struct ImageTopic {
  std::string name, type;
  std::string encoding;          // encoding of the first image's pixels, or the format of a compressed image
  int width = 0, height = 0;     // pixels of the first image; 0 if they cannot be found
  std::vector<BagImage> images;  // in the order in which they were recorded
  std::size_t unreadable = 0;    // messages whose beginning cannot be read, which have no time
  std::size_t other_sizes = 0;   // images with another size or encoding than the first one
  std::string unusable;          // reason why its images cannot be read; empty if they can
};

// The messages of a recording.
class BagStore : public image_files::ImageStore {
 public:
  explicit BagStore(std::vector<std::unique_ptr<containers::MessageFile>> files) : files_(std::move(files)) {}

  const std::vector<std::unique_ptr<containers::MessageFile>>& files() const { return files_; }
  // Reads the beginning of every image message, and keeps where they are. Called once. Returns the topics in the
  // natural order of their names.
  std::vector<ImageTopic> find_images();

  Result<image_files::StoredImage> read(std::int64_t entry) const override;
  std::string name(std::int64_t entry) const override;
  std::string source(std::int64_t entry) const override;
  std::string stream(std::int64_t entry) const override;

 private:
  struct Entry {
    containers::MessageRef message;
    std::uint32_t file = 0;
  };
  const containers::Topic& topic_of(const Entry& entry) const;
  void describe_first(ImageTopic& topic) const;

  std::vector<std::unique_ptr<containers::MessageFile>> files_;
  std::vector<Entry> entries_;
};

}  // namespace bslam::dataset
