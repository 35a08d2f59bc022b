// Writes and reads numbers as little-endian bytes on any machine, for saved maps.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/result.h"

namespace bslam::storage {

template <class T>
concept Number = std::integral<T> || std::floating_point<T>;

// Converts `count` numbers between the byte order of this machine and that of the file, in place.
template <Number T>
void swap_to_little_endian([[maybe_unused]] char* bytes, [[maybe_unused]] std::size_t count) {
  if constexpr (std::endian::native == std::endian::big) {
    for (std::size_t i = 0; i < count; ++i) std::reverse(bytes + i * sizeof(T), bytes + (i + 1) * sizeof(T));
  }
}

class ByteWriter {
 public:
  template <Number T>
  void numbers(const T* values, std::size_t count) {
    const std::size_t at = bytes_.size();
    bytes_.append(reinterpret_cast<const char*>(values), count * sizeof(T));
    swap_to_little_endian<T>(bytes_.data() + at, count);
  }
  template <Number T>
  void number(T value) {
    numbers(&value, 1);
  }
  // Writes the 32-bit number of elements or bytes that follow.
  void count(std::size_t n);
  void text(std::string_view text);

  void reserve(std::size_t bytes) { bytes_.reserve(bytes); }
  std::string take() && { return std::move(bytes_); }

 private:
  std::string bytes_;
};

// Reads one section of a file. After the first error, which is kept, all further values are 0 or empty. The
// Error names the element that was being read, as declared by enter and leave.
class ByteReader {
 public:
  ByteReader(std::string_view bytes, std::string section) : rest_(bytes), section_(std::move(section)) {}

  bool ok() const { return !error_.has_value(); }
  const Error& error() const { return *error_; }  // Error.file is left empty
  std::size_t remaining() const { return rest_.size(); }

  // Declares that the following bytes belong to element `index` of a kind, such as ("keyframe", 3), until leave is
  // called. Calls can be nested.
  void enter(std::string_view kind, std::size_t index) { place_.emplace_back(kind, index); }
  void leave() { place_.pop_back(); }

  template <Number T>
  void numbers(T* out, std::size_t count) {
    if (count > rest_.size() / sizeof(T)) {
      std::fill_n(out, count, T{});
      end_early();
      return;
    }
    if (count == 0) return;
    std::memcpy(out, rest_.data(), count * sizeof(T));
    swap_to_little_endian<T>(reinterpret_cast<char*>(out), count);
    rest_.remove_prefix(count * sizeof(T));
  }
  template <Number T>
  T number() {
    T value;
    numbers(&value, 1);
    return value;
  }
  // Reads the number of elements that follow, each of at least `bytes_each` bytes. It is an error if the remaining
  // bytes cannot contain that many, so that memory can be reserved for the returned number.
  std::size_t count(std::size_t bytes_each);
  std::string text();

  // Sets an error if `holds` is false. Returns ok().
  bool require(bool holds, std::string_view found, std::string_view expected) {
    if (!holds) fail(found, expected);
    return ok();
  }
  // Sets an error if there are remaining bytes. Returns ok().
  bool finish();

 private:
  void fail(std::string_view found, std::string_view expected);
  void end_early();

  std::string_view rest_;
  std::string section_;
  std::vector<std::pair<std::string_view, std::size_t>> place_;
  std::optional<Error> error_;
};

}  // namespace bslam::storage
