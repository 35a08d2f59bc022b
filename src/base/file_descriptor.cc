#include "base/file_descriptor.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>
#include <utility>

namespace bslam {

FileDescriptor::~FileDescriptor() {
  if (fd_ >= 0) ::close(fd_);
}

FileDescriptor::FileDescriptor(FileDescriptor&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}

FileDescriptor& FileDescriptor::operator=(FileDescriptor&& other) noexcept {
  std::swap(fd_, other.fd_);
  return *this;
}

bool FileDescriptor::close() { return ::close(std::exchange(fd_, -1)) == 0; }

Error system_error(std::string_view attempt, const std::filesystem::path& path, std::string expected) {
  const std::string reason = std::system_category().message(errno);
  std::string sentence = "cannot " + std::string(attempt) + " " + path.string() + ": " + reason;
  return {path.string(), "", reason, std::move(expected), std::move(sentence)};
}

Result<RegularFile> open_regular_file(const std::filesystem::path& path, std::size_t max_bytes) {
  // Non-blocking, so that a named pipe is rejected instead of blocking until another process writes to it.
  FileDescriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  struct stat status {};
  if (file.get() < 0 || ::fstat(file.get(), &status) != 0) return system_error("open", path, kReadable);
  if (!S_ISREG(status.st_mode))
    return Error{path.string(), "", S_ISDIR(status.st_mode) ? "a folder" : "a device or pipe", "a file"};
  const auto size = static_cast<std::size_t>(status.st_size);
  if (size > max_bytes) return too_large(path, max_bytes);
  return RegularFile{std::move(file), size};
}

Error too_large(const std::filesystem::path& path, std::size_t max_bytes) {
  return {path.string(), "", "more than " + std::to_string(max_bytes) + " bytes", "a smaller file"};
}

}  // namespace bslam
