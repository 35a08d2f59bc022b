// Memory of containers, for memory reports: the capacity that they have reserved, without the overhead of the heap.
#pragma once

#include <cstddef>
#include <memory>
#include <unordered_set>
#include <vector>

namespace bslam {

template <class T>
std::size_t memory_bytes(const std::vector<T>& values) {
  return values.capacity() * sizeof(T);
}

// Counts memory that several values may share once.
class MemoryCount {
 public:
  // Returns the bytes of a piece of memory, or 0 if it was counted before or does not exist.
  std::size_t once(const void* piece, std::size_t bytes) {
    return piece != nullptr && counted_.insert(piece).second ? bytes : 0;
  }

  // Bytes of the control block of a shared pointer.
  static constexpr std::size_t kShared = 2 * sizeof(void*);

 private:
  std::unordered_set<const void*> counted_;
};

}  // namespace bslam
