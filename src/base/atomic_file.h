// Whole files in and out: what is written appears under its name complete or not at all.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

#include "base/result.h"

namespace bslam {

// Writes `bytes` to a file beside `path`, flushes it to the disk and renames it. The folder exists; an existing file is
// replaced. On error nothing is left behind and an existing file is as it was.
Status write_atomically(const std::filesystem::path& path, std::string_view bytes);

// The bytes of a regular file. Errors: it does not exist, cannot be read, is no regular file, or has over `max_bytes`.
Result<std::string> read_file(const std::filesystem::path& path, std::size_t max_bytes);

}  // namespace bslam
