// Decompression of chunks of recordings.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace bslam::containers {

enum class Compression { kNone, kBz2, kLz4, kZstd };

// Returns nullopt for an unknown name; an empty name is kNone. Names are those of ROS bags and MCAP.
std::optional<Compression> compression_named(std::string_view name);

// Decompresses a bz2, LZ4 frame or zstd stream up to `max_bytes` of output. The output grows with what is really there,
// so that a wrong size in a file reserves no memory. If the input is truncated or damaged, the output ends early.
std::string decompress(Compression compression, std::string_view bytes, std::size_t max_bytes);

}  // namespace bslam::containers
