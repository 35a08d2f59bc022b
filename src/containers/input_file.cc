#include "containers/input_file.h"

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <limits>
#include <utility>

namespace bslam::containers {

Result<InputFile> InputFile::open(const std::filesystem::path& path) {
  auto opened = open_regular_file(path, std::numeric_limits<std::size_t>::max());
  if (!opened) return opened.error();
  InputFile file;
  file.path_ = path;
  file.size_ = opened->size;
  file.file_ = std::move(opened->descriptor);
  return file;
}

std::string InputFile::read(std::uint64_t at, std::uint64_t count) const {
  if (at >= size_) return {};
  std::string bytes(static_cast<std::size_t>(std::min(count, size_ - at)), '\0');
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t got = ::pread(file_.get(), bytes.data() + done, bytes.size() - done, static_cast<off_t>(at + done));
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) break;
    done += static_cast<std::size_t>(got);
  }
  bytes.resize(done);
  return bytes;
}

}  // namespace bslam::containers
