#include "base/behind_links.h"

namespace bslam {

std::filesystem::path behind_links(const std::filesystem::path& path, std::error_code& error) {
  constexpr int kMaxLinks = 40;  // as in the kernel
  std::filesystem::path end = path;
  std::error_code ignored;  // of a file that does not exist
  error.clear();
  for (int links = 0; !error && std::filesystem::is_symlink(end, ignored); ++links) {
    if (links == kMaxLinks) {
      error = std::make_error_code(std::errc::too_many_symbolic_link_levels);
    } else {
      const std::filesystem::path next = std::filesystem::read_symlink(end, error);
      end = end.parent_path() / next;  // `next` alone if it is absolute
    }
  }
  return end;
}

}  // namespace bslam
