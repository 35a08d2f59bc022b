// Files that are mapped into memory: their pages are read when they are used, and the system may drop them again.
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <string_view>

#include "base/result.h"

namespace bslam {

// The bytes of a regular file, unmapped when the last copy is destroyed. The file must not be modified or truncated
// while it is mapped. Replacing it by renaming another file onto its name is allowed.
class MappedFile {
 public:
  // Errors: the file cannot be opened or mapped, is not a regular file, or is larger than `max_bytes`.
  static Result<MappedFile> open(const std::filesystem::path& path, std::size_t max_bytes);

  std::string_view bytes() const { return bytes_; }
  const std::shared_ptr<const void>& owner() const { return owner_; }
  // Tells the operating system that the pages read so far are not needed soon (madvise). They leave the resident memory
  // of the process until they are read again.
  void release() const;

 private:
  std::shared_ptr<const void> owner_;
  std::string_view bytes_;
};

}  // namespace bslam
