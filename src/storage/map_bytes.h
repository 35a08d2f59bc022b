// Writes and reads the numbers of saved maps, as little-endian bytes on any machine.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/byte_reader.h"
#include "base/result.h"
#include "base/shared_array.h"

namespace bslam::storage {

// Alignment in bytes of arrays in files of version 5, so that they can be used in place.
constexpr std::size_t kAlignment = 8;

template <class T>
concept Number = std::integral<T> || std::floating_point<T>;

class ByteWriter {
 public:
  template <Number T>
  void numbers(const T* values, std::size_t count) {
    const std::size_t at = bytes_.size();
    bytes_.append(reinterpret_cast<const char*>(values), count * sizeof(T));
    if constexpr (std::endian::native == std::endian::big) {
      for (std::size_t i = at; i < bytes_.size(); i += sizeof(T)) std::reverse(&bytes_[i], &bytes_[i] + sizeof(T));
    }
  }
  template <Number T>
  void number(T value) {
    numbers(&value, 1);
  }
  // Writes the 32-bit number of elements or bytes that follow.
  void count(std::size_t n);
  void text(std::string_view text);
  // Writes zeros up to a multiple of kAlignment bytes.
  void align() { bytes_.resize((bytes_.size() + kAlignment - 1) / kAlignment * kAlignment, '\0'); }
  // Writes an array that begins at a multiple of kAlignment bytes, and zeros up to another one.
  template <Number T>
  void array(const T* values, std::size_t count) {
    align();
    if (count > 0) numbers(values, count);
    align();
  }
  // Replaces a number that was written at this position.
  template <Number T>
  void replace(std::size_t position, T value) {
    ByteWriter one;
    one.number(value);
    bytes_.replace(position, sizeof(T), one.bytes_);
  }
  std::size_t size() const { return bytes_.size(); }

  void reserve(std::size_t bytes) { bytes_.reserve(bytes); }
  std::string take() && { return std::move(bytes_); }

 private:
  std::string bytes_;
};

// Reads one section of a file. After the first error, which is kept, all further values are 0 or empty. The
// Error names the element that was being read, as declared by enter and leave.
class SectionReader {
 public:
  // Arrays are not copied if there is an owner of the bytes.
  SectionReader(std::string_view bytes, std::string section, std::shared_ptr<const void> owner = {})
      : bytes_(bytes), whole_(bytes), owner_(std::move(owner)), section_(std::move(section)) {}

  bool ok() const { return !error_.has_value(); }
  const Error& error() const { return *error_; }  // Error.file is left empty
  std::size_t remaining() const { return bytes_.left(); }

  // Declares that the following bytes belong to element `index` of a kind, such as ("keyframe", 3), until leave is
  // called. Calls can be nested.
  void enter(std::string_view kind, std::size_t index) { place_.emplace_back(kind, index); }
  void leave() { place_.pop_back(); }

  template <Number T>
  void numbers(T* out, std::size_t count) {
    bytes_.numbers(out, count);
    if (!bytes_.ok()) fail("the end of the section", "more bytes");
  }
  template <Number T>
  T number() {
    T value;
    numbers(&value, 1);
    return value;
  }
  // Reads an array as ByteWriter::array writes it, of elements that consist of numbers N.
  template <Number N, class T = N>
  SharedArray<T> array(std::size_t count) {
    align();
    if (!require(count <= remaining() / sizeof(T), "the end of the section", "more bytes") || count == 0) return {};
    const char* const at = whole_.data() + bytes_.position();
    const bool in_place =
        owner_ && std::endian::native == std::endian::little && reinterpret_cast<std::uintptr_t>(at) % alignof(T) == 0;
    if (in_place) {
      bytes_.skip(count * sizeof(T));
      align();
      return {owner_, reinterpret_cast<const T*>(at), count};
    }
    std::vector<T> copy(count);
    numbers(reinterpret_cast<N*>(copy.data()), count * (sizeof(T) / sizeof(N)));
    align();
    return copy;
  }
  // Skips zeros up to a multiple of kAlignment bytes from the beginning of the section.
  void align();
  // A reader of the bytes [from, to) of the section.
  SectionReader part(std::size_t from, std::size_t to) const {
    return {whole_.substr(from, to - from), section_, owner_};
  }
  std::size_t size() const { return whole_.size(); }

  // Reads the number of elements that follow, each of at least `bytes_each` bytes. It is an error if the remaining
  // bytes cannot contain that many, so that memory can be reserved for the returned number.
  std::size_t count(std::size_t bytes_each);
  std::string text();

  // Sets an error if `holds` is false. Returns ok().
  bool require(bool holds, std::string_view found, std::string_view expected) {
    if (!holds) fail(found, expected);
    return ok();
  }
  // Takes over the error of another reader of the same section.
  void refuse(Error error) {
    bytes_ = ByteReader({});
    if (!error_) error_ = std::move(error);
  }
  // Sets an error if there are remaining bytes. Returns ok().
  bool finish();

 private:
  void fail(std::string_view found, std::string_view expected);

  ByteReader bytes_;
  std::string_view whole_;
  std::shared_ptr<const void> owner_;
  std::string section_;
  std::vector<std::pair<std::string_view, std::size_t>> place_;
  std::optional<Error> error_;
};

}  // namespace bslam::storage
