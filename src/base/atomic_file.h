// Reading and writing of whole files. A written file appears under its name completely or not at all.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>

#include "base/result.h"

namespace bslam {

// Writes `bytes` to a temporary file in the same folder, flushes it to disk and renames it to `path`. The folder must
// exist. An existing regular file is replaced; a device, for example, is an error. Of a symbolic link, the file that it
// leads to is replaced or created. On error the temporary file is removed and an existing file is unchanged.
Status write_atomically(const std::filesystem::path& path, std::string_view bytes);
// Writes these pieces one after the other.
Status write_atomically(const std::filesystem::path& path, std::span<const std::string_view> pieces);

// Checks whether write_atomically could write a file of this name, by creating and removing a temporary file in its
// folder. Errors: the folder does not exist or is not writable; the name belongs to something other than a regular
// file.
Status check_writable(const std::filesystem::path& path);

// Returns the contents of a regular file. Errors: the file cannot be opened or read, is not a regular file, or is
// larger than `max_bytes`.
Result<std::string> read_file(const std::filesystem::path& path, std::size_t max_bytes);
// The same for a text in UTF-8, without the byte order mark that some editors write.
Result<std::string> read_text(const std::filesystem::path& path, std::size_t max_bytes);

}  // namespace bslam
