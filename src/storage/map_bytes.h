// Numbers as bytes and back, little endian whatever the machine, for saved maps. Internal to io.
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

// Turns `count` numbers between the order of this machine and that of the file, in place.
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
  // A 32-bit number of things or bytes, which come next.
  void count(std::size_t n);
  void text(std::string_view text);

  void reserve(std::size_t bytes) { bytes_.reserve(bytes); }
  std::string take() && { return std::move(bytes_); }

 private:
  std::string bytes_;
};

// Reads one section of a file. The first thing that is wrong is kept as an Error and ends the reading: from there on
// everything reads as 0 or empty and nothing more is kept. The Error names where it was, as told by enter and leave.
class ByteReader {
 public:
  ByteReader(std::string_view bytes, std::string section) : rest_(bytes), section_(std::move(section)) {}

  bool ok() const { return !error_.has_value(); }
  const Error& error() const { return *error_; }  // `file` is left empty
  std::size_t remaining() const { return rest_.size(); }

  // From here on the reader is in part `index` of its kind ("keyframe", 3) of what it was in.
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
  // A number of things of at least `bytes_each` bytes. Fails where the rest cannot hold that many, so that room may be
  // made for as many as it says.
  std::size_t count(std::size_t bytes_each);
  std::string text();

  // Fails where `holds` is false; returns ok().
  bool require(bool holds, std::string_view found, std::string_view expected) {
    if (!holds) fail(found, expected);
    return ok();
  }
  // Fails where bytes are left; returns ok().
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
