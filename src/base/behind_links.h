// The files that symbolic links lead to.
#pragma once

#include <filesystem>
#include <system_error>

namespace bslam {

// The file at the end of symbolic links, which may not exist; the path itself if it is no link. Error: a link cannot be
// read, or there are too many.
std::filesystem::path behind_links(const std::filesystem::path& path, std::error_code& error);

}  // namespace bslam
