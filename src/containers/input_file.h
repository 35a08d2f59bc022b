// A file with random access. Reading changes no state, so that several threads may read at the same time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>

#include "base/file_descriptor.h"
#include "base/result.h"

namespace bslam::containers {

class InputFile {
 public:
  // Errors: the file cannot be opened or is not a regular file.
  static Result<InputFile> open(const std::filesystem::path& path);

  const std::filesystem::path& path() const { return path_; }
  std::uint64_t size() const { return size_; }  // bytes, when it was opened

  // Returns `count` bytes from position `at`, or those up to the end of the file. Returns fewer bytes if a part cannot
  // be read.
  std::string read(std::uint64_t at, std::uint64_t count) const;

 private:
  std::filesystem::path path_;
  std::uint64_t size_ = 0;
  FileDescriptor file_;
};

}  // namespace bslam::containers
