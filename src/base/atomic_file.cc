#include "base/atomic_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <utility>

#include "base/behind_links.h"
#include "base/file_descriptor.h"

namespace bslam {
namespace {

constexpr const char* kWritable = "a file that can be written";

bool write_all(int fd, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(fd, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return false;
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  return true;
}

// Creates a new file with a unique name in the folder of `path`; its path is stored in `name`.
int open_beside(const std::filesystem::path& path, std::filesystem::path& name) {
  for (int attempt = 0;; ++attempt) {
    name = path;
    name += ".part-" + std::to_string(::getpid()) + "-" + std::to_string(attempt);
    const int fd = ::open(name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (fd >= 0 || errno != EEXIST) return fd;
  }
}

// An existing file can be replaced by another one; a folder or a device cannot.
Status check_replaceable(const std::filesystem::path& path) {
  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::status(path, error);
  if (!std::filesystem::exists(status) || std::filesystem::is_regular_file(status)) return {};
  return Error{path.string(), "", "something other than a regular file", "a regular file or a new name"};
}

// The file that is replaced: the one at the end of symbolic links, which stay.
Result<std::filesystem::path> replaced_file(const std::filesystem::path& path) {
  std::error_code error;
  std::filesystem::path end = behind_links(path, error);
  if (!error) return end;
  errno = error.value();
  return system_error("write", path, kWritable);
}

}  // namespace

Status check_writable(const std::filesystem::path& path) {
  if (Status replaceable = check_replaceable(path); !replaceable) return replaceable;
  const auto target = replaced_file(path);
  if (!target) return target.error();
  std::filesystem::path part;
  const FileDescriptor file(open_beside(*target, part));
  if (file.get() < 0) return system_error("write", path, kWritable);
  ::unlink(part.c_str());
  return {};
}

Status write_atomically(const std::filesystem::path& path, std::string_view bytes) {
  return write_atomically(path, std::span(&bytes, 1));
}

Status write_atomically(const std::filesystem::path& path, std::span<const std::string_view> pieces) {
  if (Status replaceable = check_replaceable(path); !replaceable) return replaceable;
  const auto target = replaced_file(path);
  if (!target) return target.error();
  std::filesystem::path part;
  FileDescriptor file(open_beside(*target, part));
  if (file.get() < 0) return system_error("write", path, kWritable);
  const bool written = std::ranges::all_of(pieces, [&](std::string_view p) { return write_all(file.get(), p); }) &&
                       ::fsync(file.get()) == 0 && file.close() && ::rename(part.c_str(), target->c_str()) == 0;
  if (!written) {
    const Error error = system_error("write", path, kWritable);
    ::unlink(part.c_str());
    return error;
  }
  // The new name is durable once the folder is flushed. A file system that cannot flush folders is not an error.
  const std::filesystem::path folder = target->has_parent_path() ? target->parent_path() : std::filesystem::path(".");
  const FileDescriptor opened(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (opened.get() >= 0) ::fsync(opened.get());
  return {};
}

Result<std::string> read_file(const std::filesystem::path& path, std::size_t max_bytes) {
  const auto file = open_regular_file(path, max_bytes);
  if (!file) return file.error();
  // One byte more, so that the end of the file is detected without growing the buffer.
  std::string bytes(file->size + 1, '\0');
  std::size_t size = 0;
  for (;;) {
    if (size == bytes.size()) bytes.resize(2 * size);  // the file has grown since fstat
    const ssize_t got = ::read(file->descriptor.get(), bytes.data() + size, bytes.size() - size);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return system_error("read", path, kReadable);
    if (got == 0) break;
    size += static_cast<std::size_t>(got);
    if (size > max_bytes) return too_large(path, max_bytes);
  }
  bytes.resize(size);
  return bytes;
}

Result<std::string> read_text(const std::filesystem::path& path, std::size_t max_bytes) {
  auto text = read_file(path, max_bytes);
  if (text && text->starts_with("\xEF\xBB\xBF")) text->erase(0, 3);
  return text;
}

}  // namespace bslam
