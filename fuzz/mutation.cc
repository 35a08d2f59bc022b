#include "mutation.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdint>
#include <cstring>
#include <string_view>

namespace bslam::fuzz {
namespace {

constexpr std::size_t kMaxBytes = std::size_t{1} << 16;  // larger inputs are slow and find nothing new

std::size_t below(std::size_t n, Random& random) { return n == 0 ? 0 : random.below(static_cast<std::uint32_t>(n)); }

void change_bytes(std::string& s, Random& random) {
  for (std::size_t n = 1 + below(4, random); n > 0 && !s.empty(); --n) {
    char& c = s[below(s.size(), random)];
    c = static_cast<char>(random.below(2) == 0 ? c ^ (1 << random.below(8)) : static_cast<int>(random.below(256)));
  }
}

// Replaces a number of 1, 2, 4 or 8 bytes by a boundary value or a value close to one.
void change_binary_number(std::string& s, Random& random) {
  constexpr std::array<std::uint64_t, 12> kBorders = {0,
                                                      1,
                                                      0x7f,
                                                      0xff,
                                                      0x7fff,
                                                      0xffff,
                                                      0x7fffffff,
                                                      0x80000000,
                                                      0xffffffff,
                                                      0x7ff0000000000000,
                                                      0x7ff8000000000000,
                                                      0xffffffffffffffff};
  const std::size_t size = std::size_t{1} << random.below(4);
  if (s.size() < size) return;
  const std::size_t at = below(s.size() - size + 1, random);
  std::uint64_t value = 0;
  std::memcpy(&value, s.data() + at, size);
  value = random.below(2) == 0 ? kBorders[random.below(kBorders.size())] : value + random.below(33) - 16;
  std::memcpy(s.data() + at, &value, size);
}

// Replaces a number in text.
void change_text_number(std::string& s, Random& random) {
  constexpr std::array<std::string_view, 20> kNumbers = {"0",
                                                         "-1",
                                                         "1",
                                                         "1e308",
                                                         "1e-320",
                                                         "-1e999",
                                                         "nan",
                                                         "inf",
                                                         ".",
                                                         "",
                                                         "1e",
                                                         "0x10",
                                                         "2147483648",
                                                         "9223372036854775808",
                                                         "-9223372036854775809",
                                                         "99999999999999999999999",
                                                         "1_000",
                                                         "20001",
                                                         "0.000000000000000000001",
                                                         "3.5"};
  const auto digit = [](char c) {
    return std::isdigit(static_cast<unsigned char>(c)) != 0 || c == '.' || c == '-' || c == 'e';
  };
  const std::size_t from = below(s.size(), random);
  const auto first = std::find_if(s.begin() + static_cast<std::ptrdiff_t>(from), s.end(), digit);
  if (first == s.end()) return;
  const auto last = std::find_if_not(first, s.end(), digit);
  s.replace(first, last, kNumbers[random.below(kNumbers.size())]);
}

void change_range(std::string& s, Random& random) {
  if (s.empty()) return;
  const std::size_t from = below(s.size(), random),
                    n = 1 +
                        below(std::min<std::size_t>(s.size() - from, 1 + (std::size_t{1} << random.below(12))), random);
  switch (random.below(3)) {
    case 0:
      s.erase(from, n);
      break;
    case 1: {  // duplicates it, sometimes many times
      const std::string part = s.substr(from, n);
      const std::size_t times = random.below(8) == 0 ? 1 + below(200, random) : 1;
      for (std::size_t i = 0; i < times && s.size() + n < kMaxBytes; ++i) s.insert(from, part);
      break;
    }
    default:
      s.replace(below(s.size() - n + 1, random), n, s.substr(from, n));
  }
}

void take_from_another(std::string& s, std::span<const std::string> corpus, Random& random) {
  const std::string& other = corpus[below(corpus.size(), random)];
  if (other.empty()) return;
  const std::size_t from = below(other.size(), random), n = 1 + below(other.size() - from, random);
  const std::size_t at = below(s.size() + 1, random);
  if (random.below(2) == 0) {
    s.insert(at, other, from, n);
  } else {
    s = s.substr(0, at) + other.substr(from);
  }
}

// Lines and separators, which are important in text formats.
void insert_token(std::string& s, Random& random) {
  constexpr std::array<std::string_view, 22> kTokens = {
      "\n",   "\r\n",      " ",  ",", ":",   ": ",          "- ",           "[", "]", "{", "}", "#", "&a ", "*a",
      "<<: ", "!!binary ", "\"", "'", "|\n", "%YAML:1.0\n", "\xEF\xBB\xBF", "~"};
  s.insert(below(s.size() + 1, random), kTokens[random.below(kTokens.size())]);
}

}  // namespace

std::string mutate(std::string input, std::span<const std::string> corpus, Random& random) {
  for (std::size_t n = 1 + below(5, random); n > 0; --n) {
    switch (random.below(8)) {
      case 0:
      case 1:
        change_bytes(input, random);
        break;
      case 2:
        change_binary_number(input, random);
        break;
      case 3:
        change_text_number(input, random);
        break;
      case 4:
      case 5:
        change_range(input, random);
        break;
      case 6:
        take_from_another(input, corpus, random);
        break;
      default:
        insert_token(input, random);
    }
  }
  if (input.size() > kMaxBytes) input.resize(kMaxBytes);
  return input;
}

}  // namespace bslam::fuzz
