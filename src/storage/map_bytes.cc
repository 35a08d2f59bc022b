#include "storage/map_bytes.h"

#include <limits>

#include "base/assert.h"

namespace bslam::storage {

void ByteWriter::count(std::size_t n) {
  BSLAM_ASSERT(n <= std::numeric_limits<std::uint32_t>::max(), "counts in a map file must fit into 32 bits");
  number(static_cast<std::uint32_t>(n));
}

void ByteWriter::text(std::string_view text) {
  count(text.size());
  bytes_ += text;
}

std::size_t SectionReader::count(std::size_t bytes_each) {
  const std::size_t n = number<std::uint32_t>();
  if (ok() && n > remaining() / bytes_each) {
    fail(std::to_string(n) + " elements in " + std::to_string(remaining()) + " bytes",
         "a count that fits into the section");
  }
  return ok() ? n : 0;
}

void SectionReader::align() {
  const std::size_t past = bytes_.position() % kAlignment;
  if (!ok() || past == 0) return;
  const std::string_view gap = bytes_.take(kAlignment - past);
  require(bytes_.ok() && gap.find_first_not_of('\0') == std::string_view::npos,
          "an array that is not filled up with zeros", "zeros");
}

std::string SectionReader::text() { return std::string(bytes_.take(count(1))); }

bool SectionReader::finish() {
  return require(remaining() == 0, std::to_string(remaining()) + " excess bytes", "the end of the section");
}

void SectionReader::fail(std::string_view found, std::string_view expected) {
  bytes_ = ByteReader({});
  if (error_) return;
  std::string key = section_;
  for (const auto& [kind, index] : place_) {
    key += ", ";
    key += kind;
    key += ' ' + std::to_string(index);
  }
  error_ = Error{"", std::move(key), std::string(found), std::string(expected)};
}

}  // namespace bslam::storage
