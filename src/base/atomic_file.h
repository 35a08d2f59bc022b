// Reading whole files, and writing them atomically: a written file is either complete or absent.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

#include "base/result.h"

namespace bslam {

// Writes `bytes` to a temporary file next to `path`, flushes it to disk and renames it to `path`. The folder must
// exist; an existing file is replaced. On error no temporary file remains and an existing file is unchanged.
Status write_atomically(const std::filesystem::path& path, std::string_view bytes);

// Returns the bytes of a regular file. Errors: the file does not exist, cannot be read, is not a regular file, or is
// larger than `max_bytes`.
Result<std::string> read_file(const std::filesystem::path& path, std::size_t max_bytes);

}  // namespace bslam
