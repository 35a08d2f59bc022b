// Files of the operating system, and the errors of its functions.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

#include "base/result.h"

namespace bslam {

// Owns a file descriptor; -1 if there is none.
class FileDescriptor {
 public:
  explicit FileDescriptor(int fd = -1) : fd_(fd) {}
  ~FileDescriptor();
  FileDescriptor(FileDescriptor&& other) noexcept;
  FileDescriptor& operator=(FileDescriptor&& other) noexcept;

  int get() const { return fd_; }
  bool close();  // false if the system reports an error

 private:
  int fd_;
};

// An error such as "cannot open FILE: No such file or directory", from errno.
Error system_error(std::string_view attempt, const std::filesystem::path& path, std::string expected);

constexpr const char* kReadable = "a file that can be read";

struct RegularFile {
  FileDescriptor descriptor;
  std::size_t size = 0;  // bytes
};
// Opens a file for reading. Errors: it cannot be opened, is not a regular file, or is larger than `max_bytes`.
Result<RegularFile> open_regular_file(const std::filesystem::path& path, std::size_t max_bytes);

// The error of a file that is larger than `max_bytes`.
Error too_large(const std::filesystem::path& path, std::size_t max_bytes);

}  // namespace bslam
