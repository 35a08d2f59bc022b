#include "base/byte_reader.h"

#include <gtest/gtest.h>

#include <array>

namespace bslam {
namespace {

using namespace std::string_view_literals;

TEST(ByteReaderOf, NumbersInBothByteOrders) {
  constexpr auto kBytes = "\x01\x02\x03\x04\x05\x06"sv;
  std::array<std::uint16_t, 3> values{};
  ByteReader(kBytes).numbers(values.data(), 3);
  EXPECT_EQ(values, (std::array<std::uint16_t, 3>{0x0201, 0x0403, 0x0605}));
  ByteReader big(kBytes, std::endian::big);
  EXPECT_EQ(big.number<std::uint32_t>(), 0x01020304u);
  EXPECT_EQ(big.left(), 2u);
}

TEST(ByteReaderOf, BytesThatEndEarlyGivesZeros) {
  ByteReader in("\x01\x02\x03"sv);
  std::array<std::uint16_t, 2> values{7, 7};
  in.numbers(values.data(), 2);
  EXPECT_EQ(values, (std::array<std::uint16_t, 2>{0, 0}));
  EXPECT_FALSE(in.ok());
  EXPECT_EQ(in.left(), 0u);
  EXPECT_EQ(in.number<std::uint8_t>(), 0);
  EXPECT_EQ(in.counted(), "");
}

TEST(ByteReaderOf, TextsWithTheirLengths) {
  ByteReader in("\x02\x00\x00\x00okmore"sv);
  EXPECT_EQ(in.counted(), "ok");
  in.align(4, 0);
  EXPECT_EQ(in.take(2), "re");
  EXPECT_TRUE(in.ok());
}

}  // namespace
}  // namespace bslam
