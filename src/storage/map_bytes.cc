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

std::size_t ByteReader::count(std::size_t bytes_each) {
  const std::size_t n = number<std::uint32_t>();
  if (ok() && n > rest_.size() / bytes_each) {
    fail(std::to_string(n) + " elements in " + std::to_string(rest_.size()) + " bytes",
         "a count that fits into the section");
  }
  return ok() ? n : 0;
}

std::string ByteReader::text() {
  const std::size_t size = count(1);
  std::string text(rest_.substr(0, size));
  rest_.remove_prefix(size);
  return text;
}

bool ByteReader::finish() {
  return require(rest_.empty(), std::to_string(rest_.size()) + " excess bytes", "the end of the section");
}

void ByteReader::fail(std::string_view found, std::string_view expected) {
  rest_ = {};
  if (error_) return;
  std::string key = section_;
  for (const auto& [kind, index] : place_) {
    key += ", ";
    key += kind;
    key += ' ' + std::to_string(index);
  }
  error_ = Error{"", std::move(key), std::string(found), std::string(expected)};
}

void ByteReader::end_early() { fail("the end of the section", "more bytes"); }

}  // namespace bslam::storage
