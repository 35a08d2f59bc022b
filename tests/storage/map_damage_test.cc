// A thousand damaged map files: each one is rejected or gives a valid map, and the memory used by the reader is
// bounded.
#include <gtest/gtest.h>
#include <malloc.h>

#include <atomic>
#include <cstdlib>
#include <new>

#include "base/random.h"
#include "small_map.h"
#include "storage/version_4_bytes.h"
#include "synthetic/rigs.h"

namespace {
std::atomic<std::size_t> live_bytes{0}, peak_bytes{0};
}

// Not inlined, since the compiler would warn about free() of memory from what it assumes to be the library's operator
// new.
[[gnu::noinline]] void* operator new(std::size_t size) {
  void* p = std::malloc(size > 0 ? size : 1);
  if (p == nullptr) throw std::bad_alloc();
  const std::size_t live = live_bytes += malloc_usable_size(p);
  std::size_t peak = peak_bytes;
  while (live > peak && !peak_bytes.compare_exchange_weak(peak, live)) {
  }
  return p;
}
// The library's version would call the operator above, but the version of a sanitizer would not.
[[gnu::noinline]] void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  try {
    return operator new(size);
  } catch (const std::bad_alloc&) {
    return nullptr;
  }
}
[[gnu::noinline]] void operator delete(void* p) noexcept {
  if (p != nullptr) live_bytes -= malloc_usable_size(p);
  std::free(p);
}
[[gnu::noinline]] void operator delete(void* p, std::size_t) noexcept { operator delete(p); }

namespace bslam::storage {
namespace {

constexpr std::size_t kTotal = 20, kTable = 28, kEntry = 16, kSections = 4, kHeader = kTable + kSections * kEntry + 4;

template <class T>
T number_at(const std::string& bytes, std::size_t at) {
  T value;
  std::memcpy(&value, bytes.data() + at, sizeof(T));
  return value;
}
template <class T>
void set_number(std::string& bytes, std::size_t at, T value) {
  std::memcpy(bytes.data() + at, &value, sizeof(T));
}

std::size_t section_size(const std::string& bytes, std::size_t i) {
  return number_at<std::uint64_t>(bytes, kTable + i * kEntry + 8);
}

// Sets the sizes and checksums to the values for the damaged content; the size of the last section is adjusted to the
// size of the file. `old`: a file of version 4.
void repair(std::string& bytes, bool old = false) {
  if (bytes.size() < kHeader) bytes.resize(kHeader, '\0');
  set_number(bytes, kTotal, std::uint64_t{bytes.size()});
  std::size_t at = kHeader;
  ThreadPool pool(1);
  for (std::size_t i = 0; i < kSections; ++i) {
    const std::size_t rest = bytes.size() - at;
    const std::size_t size = i + 1 == kSections ? rest : std::min(rest, section_size(bytes, i));
    const std::string_view section = std::string_view(bytes).substr(at, size);
    set_number(bytes, kTable + i * kEntry + 4, old ? crc32_of(section) : section_checksum(section, pool));
    set_number(bytes, kTable + i * kEntry + 8, std::uint64_t{size});
    at += size;
  }
  set_number(bytes, kHeader - 4, crc32_of(std::string_view(bytes).substr(0, kHeader - 4)));
}

// Returns a random position in the file. The header, small sections and the beginnings of sections are as likely as the
// rest.
std::size_t place_in(const std::string& bytes, Random& random) {
  const auto below = [&](std::size_t n) { return std::size_t{random.below(static_cast<std::uint32_t>(n))}; };
  const std::size_t section = below(kSections);
  std::size_t begin = kHeader;
  for (std::size_t i = 0; i < section; ++i) begin += section_size(bytes, i);
  switch (random.below(4)) {
    case 0:
      return below(kHeader);
    case 1:
      return begin + below(std::min<std::size_t>(section_size(bytes, section), 200));
    case 2:
      return begin + below(section_size(bytes, section));
    default:
      return below(bytes.size());
  }
}

std::string damage(const std::string& whole, Random& random) {
  std::string bytes = whole;
  const std::size_t at = place_in(whole, random);
  switch (random.below(4)) {
    case 0:
      for (std::uint32_t n = 1 + random.below(3); n > 0; --n)
        bytes[place_in(whole, random)] ^= static_cast<char>(1 + random.below(255));
      break;
    case 1:
      bytes.resize(at);
      break;
    case 2: {
      constexpr std::array<std::uint32_t, 6> kLarge = {0xffffffffu, 0x7fffffffu, 0x80000000u,
                                                       0x01000000u, 0x00010000u, 0x0000ffffu};
      if (at + 4 <= bytes.size()) set_number(bytes, at, kLarge[random.below(kLarge.size())]);
      break;
    }
    default: {
      const std::size_t from = place_in(whole, random),
                        n = std::min<std::size_t>(1 + random.below(64), bytes.size() - std::max(at, from));
      bytes.replace(at, n, bytes.substr(from, n));
    }
  }
  return bytes;
}

void expect_rejected_or_valid(const std::string& whole, bool old) {
  ASSERT_TRUE(map_from_bytes(whole, "whole"));
  Random random(2, "damage");
  int repaired_and_valid = 0, repaired_and_rejected = 0;
  std::size_t worst = 0;
  for (int n = 0; n < 1000; ++n) {
    std::string bytes = damage(whole, random);
    if (bytes == whole) continue;
    const bool repaired = n % 2 == 1;
    if (repaired) repair(bytes, old);
    const std::size_t before = live_bytes;
    peak_bytes = before;
    const auto saved = map_from_bytes(bytes, "damaged");
    const std::size_t needed = peak_bytes - before;
    worst = std::max(worst, needed);
    EXPECT_LE(needed + bytes.size(), 2 * bytes.size() + (std::size_t{64} << 20)) << n;
    if (!repaired) {
      EXPECT_FALSE(saved) << "damaged file " << n << " was accepted";
    } else if (saved) {
      EXPECT_EQ(saved->map.check_invariants(), std::nullopt);
      const std::size_t size = map_to_bytes(saved->map, saved->info).size();
      EXPECT_TRUE(old || size == bytes.size()) << size << " bytes instead of " << bytes.size();
      ++repaired_and_valid;
    } else {
      EXPECT_EQ(saved.error().file, "damaged");
      EXPECT_FALSE(saved.error().found.empty());
      ++repaired_and_rejected;
    }
  }
  EXPECT_GT(repaired_and_rejected, 150);  // the parser was exercised
  EXPECT_GT(repaired_and_valid, 20);      // for example a changed grey value of a patch is valid
  testing::Test::RecordProperty("file_bytes", static_cast<int>(whole.size()));
  testing::Test::RecordProperty("worst_bytes", static_cast<int>(worst));
}

map::BundledMap map_to_damage() {
  return small_map(synthetic::mixed_rig(), {.keyframes = 6, .max_keypoints = 30, .landmarks = 800});
}

TEST(DamagedMaps, AreRejectedOrValidWithBoundedMemory) {
  expect_rejected_or_valid(map_to_bytes(map_to_damage(), small_info()), false);
}

TEST(DamagedMaps, OfVersion4AreRejectedOrValidWithBoundedMemory) {
  expect_rejected_or_valid(version_4_bytes(map_to_damage(), small_info()), true);
}

// A mark beyond the last keypoint, with any number of others.
TEST(DamagedMaps, WithMarksOfPatchesThatNoKeypointHasAreRejected) {
  const map::BundledMap source = map_to_damage();
  frame::BundledFrame frame = *source.keyframe(source.keyframe_ids().front()).frame;
  feature::Patches& patches = frame.cameras[0].keypoints.patch;
  std::vector<std::uint8_t> wanted(patches.size(), 0);
  for (std::size_t k = 0; k < wanted.size(); k += 2) wanted[k] = 1;
  patches = patches.only(wanted);
  ASSERT_LT(patches.size(), 60);
  const std::uint64_t marks = patches.present()[0];
  map::BundledMap map(source.shared_rig(), source.pyramid());
  map.add_keyframe(std::make_shared<const frame::BundledFrame>(std::move(frame)), geometry::SE3(), {}, {});
  const std::string whole = map_to_bytes(map, small_info());
  ASSERT_TRUE(map_from_bytes(whole, "whole"));
  const std::size_t at = whole.find(std::string_view(reinterpret_cast<const char*>(&marks), sizeof(marks)));
  ASSERT_NE(at, std::string::npos);
  std::uint64_t left = marks;
  for (int cleared = 0; cleared < 4; ++cleared, left &= left - 1) {
    std::string bytes = whole;
    set_number(bytes, at, left | std::uint64_t{1} << 60);
    repair(bytes);
    EXPECT_FALSE(map_from_bytes(bytes, "damaged")) << cleared;
  }
}

// Counts larger than the file, at all positions near the beginning of sections and at some others.
TEST(DamagedMaps, WithTooLargeCountsUseBoundedMemory) {
  const std::string whole = map_to_bytes(
      small_map(synthetic::ring_rig(2), {.keyframes = 3, .max_keypoints = 8, .landmarks = 300}), small_info());
  std::vector<std::size_t> places;
  std::size_t begin = kHeader;
  for (std::size_t i = 0; i < kSections; begin += section_size(whole, i++)) {
    for (std::size_t n = 0; n < std::min<std::size_t>(section_size(whole, i), 300); ++n) places.push_back(begin + n);
  }
  for (std::size_t at = kHeader; at < whole.size(); at += 37) places.push_back(at);
  for (const std::size_t at : places) {
    if (at + 4 > whole.size()) continue;
    std::string bytes = whole;
    set_number(bytes, at, std::uint32_t{0x10000000});
    repair(bytes);
    const std::size_t before = live_bytes;
    peak_bytes = before;
    const auto saved = map_from_bytes(bytes, "damaged");
    ASSERT_LE(peak_bytes - before, whole.size() + (std::size_t{64} << 20)) << at;
  }
}

}  // namespace
}  // namespace bslam::storage
