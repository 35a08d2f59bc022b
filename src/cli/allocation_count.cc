#include "cli/allocation_count.h"

#include <atomic>
#include <cstddef>
#include <cstdlib>
#include <new>

#ifndef BSLAM_ONE_VERSION  // defined by builds with sanitizers

namespace {

std::atomic<bool> g_counting = false;
std::atomic<std::uint64_t> g_allocations = 0;

void note_allocation() {
  if (g_counting.load(std::memory_order_relaxed)) g_allocations.fetch_add(1, std::memory_order_relaxed);
}

// Allocates as the standard requires of `operator new`: calls the new-handler until there is memory or it throws.
template <class Allocate>
void* allocated(const Allocate& allocate) {
  note_allocation();
  while (true) {
    if (void* const memory = allocate()) return memory;
    const std::new_handler handler = std::get_new_handler();
    if (handler == nullptr) throw std::bad_alloc();
    handler();
  }
}

}  // namespace

// The other forms of `new` and `delete` call these. They are not inlined, because the compiler would warn about free()
// of memory from operator new.
[[gnu::noinline]] void* operator new(std::size_t size) {
  return allocated([size] { return std::malloc(size > 0 ? size : 1); });
}
[[gnu::noinline]] void* operator new(std::size_t size, std::align_val_t alignment) {
  const auto align = static_cast<std::size_t>(alignment);
  const std::size_t whole =
      (size + align - 1) / align * align;  // std::aligned_alloc requires a multiple of the alignment
  return allocated([size, whole, align]() -> void* {
    return whole < size ? nullptr : std::aligned_alloc(align, whole > 0 ? whole : align);
  });
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::align_val_t) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }

namespace bslam::cli {

std::function<std::uint64_t()> begin_counting_allocations() {
  g_counting = true;
  return [] { return g_allocations.load(std::memory_order_relaxed); };
}

}  // namespace bslam::cli

#else

namespace bslam::cli {

std::function<std::uint64_t()> begin_counting_allocations() { return {}; }

}  // namespace bslam::cli

#endif
