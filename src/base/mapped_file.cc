#include "base/mapped_file.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

namespace bslam {
namespace {

constexpr const char* kExpected = "a file that can be read";

Error system_error(const std::filesystem::path& path, const char* action) {
  return {path.string(), "", std::string("cannot ") + action + ": " + std::generic_category().message(errno),
          kExpected};
}

}  // namespace

Result<MappedFile> MappedFile::open(const std::filesystem::path& path, std::size_t max_bytes) {
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (file < 0) return system_error(path, "open");
  const std::shared_ptr<void> closed(nullptr, [file](void*) { ::close(file); });
  struct stat status {};
  if (::fstat(file, &status) != 0) return system_error(path, "open");
  if (!S_ISREG(status.st_mode)) return Error{path.string(), "", "a folder, device or pipe", "a file"};
  const auto size = static_cast<std::size_t>(status.st_size);
  if (size > max_bytes)
    return Error{path.string(), "", "more than " + std::to_string(max_bytes) + " bytes", "a smaller file"};
  MappedFile out;
  if (size == 0) return out;
  void* const at = ::mmap(nullptr, size, PROT_READ, MAP_PRIVATE, file, 0);
  if (at == MAP_FAILED) return system_error(path, "map");
  out.owner_ = std::shared_ptr<const void>(at, [at, size](const void*) { ::munmap(at, size); });
  out.bytes_ = {static_cast<const char*>(at), size};
  return out;
}

void MappedFile::release() const {
  if (owner_) ::madvise(const_cast<void*>(owner_.get()), bytes_.size(), MADV_DONTNEED);
}

}  // namespace bslam
