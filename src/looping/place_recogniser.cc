#include "looping/place_recogniser.h"

#include <algorithm>
#include <optional>
#include <span>

#include "base/cores.h"
#include "base/memory_count.h"
#include "base/thread_pool.h"

namespace bslam::looping {
namespace {

// An index of a loaded map is made by several threads.
constexpr std::size_t kManyKeyframes = 256;
constexpr int kMaxThreads = 8;

// Keyframes with scores, and the scores of their groups. The group of a keyframe consists of it and of the best `size`
// covisible keyframes that have a score and share at least `weight` landmarks with it.
class Groups {
 public:
  // `scores`: by keyframe, negative for those without.
  Groups(const map::BundledMap& map, std::span<const double> scores, int size, int weight)
      : map_(map), scores_(scores), size_(static_cast<std::size_t>(size)), weight_(weight) {
    for (std::size_t k = 0; k < scores.size(); ++k) {
      if (scores[k] >= 0) next_.push_back({KeyframeId(k), bound(KeyframeId(k)), false});
    }
    std::ranges::make_heap(next_, later);
  }

  // Returns the groups by decreasing score, one per call; nullopt after the last one. Only scores that can be the next
  // highest are computed.
  std::optional<PlaceCandidate> next() {
    while (!next_.empty()) {
      std::ranges::pop_heap(next_, later);
      Group& top = next_.back();
      if (top.final) {
        const PlaceCandidate out{top.keyframe, top.score};
        next_.pop_back();
        return out;
      }
      top = group_of(top.keyframe);
      std::ranges::push_heap(next_, later);
    }
    return std::nullopt;
  }

 private:
  struct Group {
    KeyframeId keyframe;
    double score = 0;    // an upper bound if not final
    bool final = false;  // the keyframe is then that of the group with the highest score
  };

  static bool later(const Group& a, const Group& b) {
    if (a.score != b.score) return a.score < b.score;
    return a.final != b.final ? a.final : b.keyframe < a.keyframe;
  }

  double bound(KeyframeId k) const {
    constexpr double kRounding = 1.0 + 1e-12;  // the scores of a group are added up one by one
    double highest = 0, sum = 0;
    for (const map::Covisible& c : map_.keyframe(k).covisible) {
      const double score = c.weight >= weight_ ? std::max(0.0, scores_[c.keyframe.index()]) : 0.0;
      highest = std::max(highest, score);
      sum += score;
    }
    return kRounding * (scores_[k.index()] + std::min(sum, static_cast<double>(size_) * highest));
  }

  Group group_of(KeyframeId k) const {
    double best = scores_[k.index()];
    Group group{k, best, true};
    for (const map::Covisible& c : map_.best_covisible(k, size_, weight_)) {
      const double score = scores_[c.keyframe.index()];
      if (score < 0) continue;
      group.score += score;
      if (score > best) {
        best = score;
        group.keyframe = c.keyframe;
      }
    }
    return group;
  }

  const map::BundledMap& map_;
  const std::span<const double> scores_;
  const std::size_t size_;
  const int weight_;
  std::vector<Group> next_;  // a heap
};

}  // namespace

std::vector<map::Covisible> neighbours_of(const map::BundledMap& map, KeyframeId keyframe,
                                          const RecognitionOptions& options) {
  const auto landmarks =
      std::ranges::count_if(map.keyframe(keyframe).landmarks.values(), [](LandmarkId l) { return l.valid(); });
  const double enough =
      std::max<double>(options.min_neighbour_landmarks, options.min_neighbour_ratio * static_cast<double>(landmarks));
  std::vector<map::Covisible> out;
  for (const map::Covisible& c : map.keyframe(keyframe).covisible) {
    if (c.weight >= enough) out.push_back(c);
  }
  return out;
}

BagOfWordsRecogniser::BagOfWordsRecogniser(place::VocabularyPtr vocabulary, const RecognitionOptions& options)
    : vocabulary_(std::move(vocabulary)), options_(options) {}

std::size_t BagOfWordsRecogniser::memory_bytes() const { return index_.memory_bytes() + bslam::memory_bytes(known_); }

void BagOfWordsRecogniser::describe(frame::BundledFrame& frame) const {
  for (frame::CameraFrame& c : frame.cameras) {
    if (c.words.size() == c.keypoints.size()) continue;  // already done
    std::vector<WordId> words(c.keypoints.size());
    vocabulary_->words(c.keypoints.descriptor, words);
    c.words = std::move(words);
  }
}

BagOfWordsRecogniser::Words BagOfWordsRecogniser::words_of(const frame::BundledFrame& frame) const {
  std::vector<WordId> words;  // one per unique feature: the word of its first keypoint
  words.reserve(frame.bundled.size());
  for (std::size_t f = 0; f < frame.bundled.size(); ++f) {
    const frame::KeypointRef first = frame.bundled.keypoints(FeatureId(f)).front();
    const SharedArray<WordId>& of_camera = frame.cameras[first.camera.index()].words;
    if (!of_camera.empty()) words.push_back(of_camera[first.keypoint.index()]);
  }
  return std::make_shared<const place::WordVector>(*vocabulary_, words);
}

// Updates the index to hold exactly the keyframes of `map`, regardless of which maps were used before. This is done
// before each query, so that a keyframe that has not changed must cost next to nothing.
void BagOfWordsRecogniser::sync(const map::BundledMap& map) {
  known_.resize(std::max(known_.size(), map.keyframe_slots()));
  std::vector<place::InvertedIndex::Entry> entries;
  for (std::size_t i = 0; i < known_.size(); ++i) {
    const KeyframeId k(i);
    if (!map.alive(k)) {
      index_.remove(k);
      known_[i].reset();
    } else if (const auto& frame = map.keyframe(k).frame;
               known_[i].owner_before(frame) || frame.owner_before(known_[i])) {
      index_.remove(k);
      known_[i] = frame;
      entries.push_back({k, nullptr});
    }
  }
  const bool many = entries.size() >= kManyKeyframes;
  ThreadPool pool(many ? std::min(processor_cores(), kMaxThreads) : 1);
  pool.for_each(entries.size(),
                [&](std::size_t i) { entries[i].words = words_of(*map.keyframe(entries[i].keyframe).frame); });
  index_.add(entries);
  if (many) map.release_pages();
}

std::vector<PlaceCandidate> BagOfWordsRecogniser::query_keyframe(const map::BundledMap& map, KeyframeId keyframe) {
  sync(map);
  const Words words = index_.words_of(keyframe);
  std::vector<std::uint8_t> excluded(map.keyframe_slots(), 0);
  excluded[keyframe.index()] = 1;
  // The paper's s_min: a candidate must score at least as high as the lowest-scoring neighbour.
  double min_score = 0;
  bool any = false;
  for (const map::Covisible& c : neighbours_of(map, keyframe, options_)) {
    excluded[c.keyframe.index()] = 1;
    const double score = place::l1_score(*words, *index_.words_of(c.keyframe));
    min_score = any ? std::min(min_score, score) : score;
    any = true;
  }
  return rank(map, *words, excluded, {options_.min_common_word_ratio, options_.min_group_score_ratio, min_score});
}

std::vector<PlaceCandidate> BagOfWordsRecogniser::query_frame(const map::BundledMap& map,
                                                              const frame::BundledFrame& frame) {
  sync(map);
  return rank(map, *words_of(frame), {},
              {options_.relocalisation_factor * options_.min_common_word_ratio,
               options_.relocalisation_factor * options_.min_group_score_ratio});
}

std::vector<PlaceCandidate> BagOfWordsRecogniser::rank(const map::BundledMap& map, const place::WordVector& words,
                                                       const std::vector<std::uint8_t>& excluded,
                                                       const Bounds& bounds) const {
  std::vector<place::CommonWords> sharing = index_.query(words);
  std::erase_if(sharing,
                [&](const place::CommonWords& c) { return !excluded.empty() && excluded[c.keyframe.index()]; });
  int most = 0;
  for (const place::CommonWords& c : sharing) most = std::max(most, c.count);
  std::vector<double> scores(map.keyframe_slots(), -1.0);
  for (const place::CommonWords& c : sharing) {
    if (c.count >= bounds.min_common_word_ratio * most && c.score >= bounds.min_score)
      scores[c.keyframe.index()] = c.score;
  }
  Groups groups(map, scores, options_.group, options_.min_neighbour_landmarks);
  std::vector<PlaceCandidate> out;
  // A group covers its representative and the neighbours of the representative. Keyframes that share only a few
  // landmarks, for example through a door, count as different places.
  std::vector<std::uint8_t> taken(map.keyframe_slots(), 0);
  while (out.size() < static_cast<std::size_t>(options_.max_candidates)) {
    const std::optional<PlaceCandidate> group = groups.next();
    if (!group || (!out.empty() && group->score < bounds.min_group_score_ratio * out.front().score)) break;
    if (taken[group->keyframe.index()]) continue;
    out.push_back(*group);
    taken[group->keyframe.index()] = 1;
    for (const map::Covisible& c : neighbours_of(map, group->keyframe, options_)) taken[c.keyframe.index()] = 1;
  }
  return out;
}

}  // namespace bslam::looping
