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
    std::vector<Posting>& list = by_word_[w.word.index()];
    if (list.empty() || list.back().keyframe < keyframe) {
      list.push_back({keyframe, w.weight});
    } else {
      list.insert(std::ranges::upper_bound(list, keyframe, {}, &Posting::keyframe), {keyframe, w.weight});
    }
  }
  words_.resize(std::max(words_.size(), keyframe.index() + 1));
  words_[keyframe.index()] = std::move(words);
  ++size_;
}

void InvertedIndex::add(std::span<const Entry> entries) {
  std::vector<std::size_t> more;  // number of keyframes that are added to each word
  for (const Entry& e : entries) {
    if (!e.words->empty()) more.resize(std::max(more.size(), e.words->words().back().word.index() + 1));
    for (const WeightedWord& w : e.words->words()) ++more[w.word.index()];
  }
  by_word_.resize(std::max(by_word_.size(), more.size()));
  for (std::size_t w = 0; w < more.size(); ++w) {
    // Few entries are left to the growth of the vector, which moves it less often.
    if (more[w] > std::max<std::size_t>(1, by_word_[w].size())) by_word_[w].reserve(by_word_[w].size() + more[w]);
  }
  for (const Entry& e : entries) add(e.keyframe, e.words);
}

void InvertedIndex::remove(KeyframeId keyframe) {
  if (!contains(keyframe)) return;
  const std::shared_ptr<const WordVector> words = std::exchange(words_[keyframe.index()], nullptr);
  for (const WeightedWord& w : words->words()) {
    std::vector<Posting>& list = by_word_[w.word.index()];
    list.erase(std::ranges::lower_bound(list, keyframe, {}, &Posting::keyframe));
  }
  --size_;
}

std::size_t InvertedIndex::memory_bytes() const {
  std::size_t bytes = bslam::memory_bytes(words_) + bslam::memory_bytes(by_word_);
  for (const auto& words : words_) bytes += words ? words->memory_bytes() + MemoryCount::kShared : 0;
  for (const std::vector<Posting>& list : by_word_) bytes += bslam::memory_bytes(list);
  return bytes;
}

std::shared_ptr<const WordVector> InvertedIndex::words_of(KeyframeId keyframe) const {
  return contains(keyframe) ? words_[keyframe.index()] : nullptr;
}

std::vector<CommonWords> InvertedIndex::query(const WordVector& words) const {
  std::vector<CommonWords> shared;
  if (size_ == 0) return shared;
  std::vector<int> count(words_.size(), 0);
  std::vector<double> common(words_.size(), 0);  // summed up in order of word, as by l1_score
  for (const WeightedWord& w : words.words()) {
    if (w.word.index() >= by_word_.size()) break;  // sorted: the index holds no later word either
    for (const Posting& p : by_word_[w.word.index()]) {
      ++count[p.keyframe.index()];
      common[p.keyframe.index()] += std::min(w.weight, p.weight);
    }
  }
  for (std::size_t k = 0; k < count.size(); ++k) {
    if (count[k] > 0) shared.push_back({KeyframeId(k), count[k], std::min(common[k], 1.0)});
  }
  return shared;
}

}  // namespace bslam::place
