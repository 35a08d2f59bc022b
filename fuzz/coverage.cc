// This file is compiled without instrumentation and linked to all instrumented code.
#include "coverage.h"

#include <array>
#include <bit>
#include <cstdint>
#include <vector>

namespace bslam::fuzz {
namespace {

constexpr std::size_t kPlaces = std::size_t{1} << 18;

// Counters of edges, indexed by a hash of both addresses.
struct Trace {
  std::array<std::uint8_t, kPlaces> count{};
  std::array<std::uint8_t, kPlaces> seen{};  // bit n: some input reached the edge about 2^n times
  std::vector<std::uint32_t> touched;
  std::size_t previous = 0;
  bool recording = false;
};

constinit Trace trace;  // initialised before any other code runs

}  // namespace

void begin_coverage() {
  Trace& t = trace;
  for (const std::uint32_t place : t.touched) t.count[place] = 0;
  t.touched.clear();
  t.previous = 0;
  t.recording = true;
}

std::size_t new_places() {
  Trace& t = trace;
  t.recording = false;
  std::size_t fresh = 0;
  for (const std::uint32_t place : t.touched) {
    const auto bucket = static_cast<std::uint8_t>(1u << (std::bit_width(unsigned{t.count[place]}) - 1));
    fresh += (t.seen[place] & bucket) == 0;
    t.seen[place] = static_cast<std::uint8_t>(t.seen[place] | bucket);
  }
  return fresh;
}

}  // namespace bslam::fuzz

extern "C" void __sanitizer_cov_trace_pc() {
  bslam::fuzz::Trace& t = bslam::fuzz::trace;
  if (!t.recording) return;
  // Relative to a function of the program, so that the numbers are the same in every run.
  const std::size_t here = reinterpret_cast<std::uintptr_t>(__builtin_return_address(0)) -
                           reinterpret_cast<std::uintptr_t>(&bslam::fuzz::begin_coverage);
  const std::size_t mixed = (here * 0x9e3779b97f4a7c15ull) >> 40;
  const auto place = static_cast<std::uint32_t>((mixed ^ t.previous) % bslam::fuzz::kPlaces);
  t.previous = mixed >> 1;
  std::uint8_t& count = t.count[place];
  if (count == 0) {
    t.recording = false;  // since the vector may call instrumented code
    t.touched.push_back(place);
    t.recording = true;
  }
  if (count < 255) ++count;
}
