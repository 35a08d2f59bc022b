// Files that are mapped into memory: their pages are read when they are used, and the system may drop them again.
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <string_view>

#include "base/result.h"

namespace bslam {

// The bytes of a regular file, unmapped with the last copy. The file must not be changed or cut off while it is mapped;
// replacing it by renaming another one is no change.
class MappedFile {
 public:
  // Errors: the file cannot be opened or mapped, is not a regular file, or is larger than `max_bytes`.
  static Result<MappedFile> open(const std::filesystem::path& path, std::size_t max_bytes);

  std::string_view bytes() const { return bytes_; }
  const std::shared_ptr<const void>& owner() const { return owner_; }
  // Tells the system that the pages which were read so far are not needed soon: they do not count as memory of the
  // process until they are read again.
  void release() const;

 private:
  std::shared_ptr<const void> owner_;
  std::string_view bytes_;
};

}  // namespace bslam
