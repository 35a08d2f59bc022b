#include "place/inverted_index.h"

#include <algorithm>
#include <utility>

#include "base/assert.h"
#include "base/memory_count.h"

namespace bslam::place {

void InvertedIndex::add(KeyframeId keyframe, std::shared_ptr<const WordVector> words) {
  BSLAM_ASSERT(keyframe.valid() && words != nullptr, "the keyframe must be valid and the words not null");
  BSLAM_ASSERT(!contains(keyframe), "the keyframe must not be in the index yet");
  if (!words->empty()) by_word_.resize(std::max(by_word_.size(), words->words().back().word.index() + 1));
  for (const WeightedWord& w : words->words()) {
    std::vector<KeyframeId>& list = by_word_[w.word.index()];
    list.insert(std::upper_bound(list.begin(), list.end(), keyframe), keyframe);
  }
  keyframes_.emplace(keyframe, std::move(words));
}

void InvertedIndex::remove(KeyframeId keyframe) {
  const auto found = keyframes_.find(keyframe);
  if (found == keyframes_.end()) return;
  for (const WeightedWord& w : found->second->words()) {
    std::vector<KeyframeId>& list = by_word_[w.word.index()];
    list.erase(std::lower_bound(list.begin(), list.end(), keyframe));
  }
  keyframes_.erase(found);
}

std::size_t InvertedIndex::memory_bytes() const {
  constexpr std::size_t kTreeNode = 4 * sizeof(void*);  // colour, parent and children of a node of std::map
  std::size_t bytes = keyframes_.size() * (kTreeNode + sizeof(decltype(keyframes_)::value_type));
  for (const auto& [keyframe, words] : keyframes_) bytes += words->memory_bytes() + MemoryCount::kShared;
  bytes += bslam::memory_bytes(by_word_);
  for (const std::vector<KeyframeId>& list : by_word_) bytes += bslam::memory_bytes(list);
  return bytes;
}

std::shared_ptr<const WordVector> InvertedIndex::words_of(KeyframeId keyframe) const {
  const auto found = keyframes_.find(keyframe);
  return found != keyframes_.end() ? found->second : nullptr;
}

std::vector<CommonWords> InvertedIndex::query(const WordVector& words) const {
  std::vector<CommonWords> shared;
  if (keyframes_.empty()) return shared;
  std::vector<int> count(keyframes_.rbegin()->first.index() + 1, 0);
  for (const WeightedWord& w : words.words()) {
    if (w.word.index() >= by_word_.size()) break;  // sorted: the index holds no later word either
    for (const KeyframeId keyframe : by_word_[w.word.index()]) ++count[keyframe.index()];
  }
  for (std::size_t k = 0; k < count.size(); ++k) {
    if (count[k] > 0) shared.push_back({KeyframeId(k), count[k]});
  }
  return shared;
}

}  // namespace bslam::place
