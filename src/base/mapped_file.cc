#include "base/mapped_file.h"

#include <sys/mman.h>

#include "base/file_descriptor.h"

namespace bslam {
Result<MappedFile> MappedFile::open(const std::filesystem::path& path, std::size_t max_bytes) {
  const auto file = open_regular_file(path, max_bytes);
  if (!file) return file.error();
  MappedFile out;
  const std::size_t size = file->size;
  if (size == 0) return out;
  void* const at = ::mmap(nullptr, size, PROT_READ, MAP_PRIVATE, file->descriptor.get(), 0);
  if (at == MAP_FAILED) return system_error("map", path, kReadable);
  out.owner_ = std::shared_ptr<const void>(at, [at, size](const void*) { ::munmap(at, size); });
  out.bytes_ = {static_cast<const char*>(at), size};
  return out;
}

void MappedFile::release() const {
  if (owner_) ::madvise(const_cast<void*>(owner_.get()), bytes_.size(), MADV_DONTNEED);
}

}  // namespace bslam
