// Reads numbers, strings and arrays from bytes in memory, with every access checked.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string_view>
#include <type_traits>

namespace bslam {

// A read beyond the end gives zero or an empty string, and makes ok() false from then on.
class ByteReader {
 public:
  explicit ByteReader(std::string_view bytes, std::endian order = std::endian::little) : bytes_(bytes), order_(order) {}

  bool ok() const { return ok_; }
  std::size_t position() const { return at_; }
  std::size_t left() const { return bytes_.size() - at_; }

  template <class T>
  void numbers(T* out, std::size_t count) {
    static_assert(std::is_arithmetic_v<T>);
    const std::string_view from = count > left() / sizeof(T) ? take(left() + 1) : take(count * sizeof(T));
    if (from.empty()) {
      std::fill_n(out, count, T{});
      return;
    }
    char* const raw = reinterpret_cast<char*>(out);
    std::memcpy(raw, from.data(), from.size());
    for (std::size_t i = 0; i < count && order_ != std::endian::native; ++i)
      std::reverse(raw + i * sizeof(T), raw + (i + 1) * sizeof(T));
  }
  template <class T>
  T number() {
    T value;
    numbers(&value, 1);
    return value;
  }

  // The next `count` bytes.
  std::string_view take(std::uint64_t count) {
    if (count > left()) {
      ok_ = false;
      at_ = bytes_.size();
      return {};
    }
    const std::string_view out = bytes_.substr(at_, static_cast<std::size_t>(count));
    at_ += out.size();
    return out;
  }

  // A 32-bit length and as many bytes.
  std::string_view counted() { return take(number<std::uint32_t>()); }

  void skip(std::uint64_t count) { take(count); }

  // Skips to a multiple of `size` bytes from the position `origin`.
  void align(std::size_t size, std::size_t origin) {
    const std::size_t past = (at_ - origin) % size;
    if (past != 0) skip(size - past);
  }

 private:
  std::string_view bytes_;
  std::endian order_;
  std::size_t at_ = 0;
  bool ok_ = true;
};

}  // namespace bslam
