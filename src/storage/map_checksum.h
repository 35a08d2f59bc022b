// Checksums of the sections of saved maps.
#pragma once

#include <cstdint>
#include <string_view>

#include "base/thread_pool.h"

namespace bslam::storage {

// CRC-32, as in zlib and PNG.
std::uint32_t crc32_of(std::string_view bytes);

// Checksum of a section of version 5: the CRC-32 of the list of CRC-32s (u32) of its blocks of 1 MiB, so that several
// threads can compute it.
std::uint32_t section_checksum(std::string_view bytes, ThreadPool& pool);

}  // namespace bslam::storage
