// An immutable array whose copies share its elements: copying costs no more than copying a pointer.
#pragma once

#include <algorithm>
#include <cstddef>
#include <memory>
#include <utility>
#include <vector>

#include "base/memory_count.h"

namespace bslam {

// Reads like a const std::vector. To change elements, copy them to a vector and make another array of it.
template <class T>
class SharedArray {
 public:
  using value_type = T;

  SharedArray() = default;
  // Takes ownership of the elements. The conversion is implicit, so that a vector can be moved into an array.
  SharedArray(std::vector<T>&& values) {  // NOLINT(google-explicit-constructor)
    if (values.empty()) return;
    values.shrink_to_fit();  // some arrays live as long as the map
    auto owned = std::make_shared<const std::vector<T>>(std::move(values));
    data_ = owned->data();
    size_ = owned->size();
    owner_ = std::move(owned);
  }
  // Elements that lie in memory of another owner, such as a mapped file, which lives as long as any array in it.
  SharedArray(std::shared_ptr<const void> owner, const T* data, std::size_t size)
      : owner_(std::move(owner)), data_(data), size_(size), borrowed_(true) {}

  std::size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }
  const T* data() const { return data_; }
  const T& operator[](std::size_t i) const { return data_[i]; }
  const T& front() const { return data_[0]; }
  const T& back() const { return data_[size_ - 1]; }
  const T* begin() const { return data_; }
  const T* end() const { return data_ + size_; }
  // The memory of the elements, unless it was counted before or is that of another owner.
  std::size_t memory_bytes(MemoryCount& count) const {
    if (!owner_ || borrowed_) return 0;
    return count.once(data_, sizeof(std::vector<T>) + MemoryCount::kShared + size_ * sizeof(T));
  }
  std::vector<T> copy() const { return {begin(), end()}; }
  friend bool operator==(const SharedArray& a, const SharedArray& b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end());
  }

 private:
  std::shared_ptr<const void> owner_;  // keeps the elements alive
  const T* data_ = nullptr;
  std::size_t size_ = 0;
  bool borrowed_ = false;  // the elements belong to another owner, such as a mapped file
};

}  // namespace bslam
