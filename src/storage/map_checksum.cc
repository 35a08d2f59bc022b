#include "storage/map_checksum.h"

#include <libdeflate.h>

#include <vector>

#include "storage/map_bytes.h"

namespace bslam::storage {

std::uint32_t crc32_of(std::string_view bytes) { return libdeflate_crc32(0, bytes.data(), bytes.size()); }

std::uint32_t section_checksum(std::string_view bytes, ThreadPool& pool) {
  constexpr std::size_t kBlock = std::size_t{1} << 20;
  std::vector<std::uint32_t> blocks((bytes.size() + kBlock - 1) / kBlock);
  pool.for_each(blocks.size(), [&](std::size_t i) { blocks[i] = crc32_of(bytes.substr(i * kBlock, kBlock)); });
  ByteWriter list;
  if (!blocks.empty()) list.numbers(blocks.data(), blocks.size());
  return crc32_of(std::move(list).take());
}

}  // namespace bslam::storage
