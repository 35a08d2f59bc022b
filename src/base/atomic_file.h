// Reading and writing of whole files. A written file appears under its name completely or not at all.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

#include "base/result.h"

namespace bslam {

// Writes `bytes` to a temporary file in the same folder, flushes it to disk and renames it to `path`. The folder must
// exist. An existing file is replaced. On error the temporary file is removed and an existing file is unchanged.
Status write_atomically(const std::filesystem::path& path, std::string_view bytes);

// Returns the contents of a regular file. Errors: the file cannot be opened or read, is not a regular file, or is
// larger than `max_bytes`.
Result<std::string> read_file(const std::filesystem::path& path, std::size_t max_bytes);

}  // namespace bslam
