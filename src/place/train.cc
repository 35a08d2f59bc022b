#include "place/train.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <utility>

#include "base/assert.h"
#include "place/majority_clustering.h"

namespace bslam::place {
namespace {

using feature::Descriptor;

// The descriptors of a tree node, as a range of Training::order.
struct Cell {
  std::size_t begin = 0, end = 0;
  std::size_t size() const { return end - begin; }
};

// The children of a divided node: their centres and cells. Both are empty if the node becomes a word.
struct Division {
  std::vector<Descriptor> centre;
  std::vector<Cell> cell;
};

struct Training {
  std::vector<Descriptor> descriptor;  // descriptors of all images, concatenated
  std::vector<std::uint32_t> image;    // index of the image of each descriptor
  // Permutation of the descriptors: the descriptors of a node are adjacent and in ascending order.
  std::vector<std::uint32_t> order;
};

Training gather(std::span<const std::vector<Descriptor>> images) {
  Training t;
  std::size_t count = 0;
  for (const auto& image : images) count += image.size();
  t.descriptor.reserve(count);
  t.image.reserve(count);
  for (std::size_t i = 0; i < images.size(); ++i) {
    t.descriptor.insert(t.descriptor.end(), images[i].begin(), images[i].end());
    t.image.insert(t.image.end(), images[i].size(), static_cast<std::uint32_t>(i));
  }
  for (std::size_t i = 0; i < count; ++i) t.order.push_back(static_cast<std::uint32_t>(i));
  return t;
}

// Reorders only its own cell of `order`.
Division divide(Training& t, const Cell& cell, const TrainingOptions& options, Random random) {
  const std::span<std::uint32_t> order(t.order.data() + cell.begin, cell.size());
  std::vector<Descriptor> members(order.size());
  for (std::size_t i = 0; i < order.size(); ++i) members[i] = t.descriptor[order[i]];
  Clusters clusters = cluster_by_majority(members, options.branching, options.iterations, random);
  Division division;
  if (clusters.centre.size() < 2) return division;

  std::vector<std::size_t> at(clusters.centre.size() + 1, 0);
  for (const std::uint8_t c : clusters.of) ++at[c + 1u];
  for (std::size_t c = 1; c < at.size(); ++c) {
    at[c] += at[c - 1];
    division.cell.push_back({cell.begin + at[c - 1], cell.begin + at[c]});
  }
  std::vector<std::uint32_t> sorted(order.size());
  for (std::size_t i = 0; i < order.size(); ++i) sorted[at[clusters.of[i]]++] = order[i];
  std::copy(sorted.begin(), sorted.end(), order.begin());
  division.centre = std::move(clusters.centre);
  return division;
}

float inverse_document_frequency(const Training& t, const Cell& cell, std::size_t images) {
  std::size_t images_with_word = 1;
  for (std::size_t i = cell.begin + 1; i < cell.end; ++i)
    images_with_word += t.image[t.order[i]] != t.image[t.order[i - 1]];
  return static_cast<float>(std::log(static_cast<double>(images + 1) / static_cast<double>(images_with_word)));
}

// Thread-safe progress counter.
class Counter {
 public:
  Counter(const TrainingProgress& progress, std::size_t all) : progress_(progress), all_(all) {}
  void add(std::size_t count) {
    const std::lock_guard lock(mutex_);
    done_ += count;
    if (progress_) progress_(done_, all_);
  }

 private:
  std::mutex mutex_;
  const TrainingProgress& progress_;
  std::size_t done_ = 0, all_;
};

// Builds the tree level by level, which is the order of the nodes. Each node uses its own random generator, so that the
// nodes of a level can be divided in parallel.
VocabularyContent grow(Training& t, std::size_t images, const TrainingOptions& options, Random& random,
                       ThreadPool& pool, const TrainingProgress& progress) {
  Counter counter(progress, t.order.size() * static_cast<std::size_t>(options.levels));
  VocabularyContent content;
  content.branching = options.branching;
  content.levels = options.levels;
  std::vector<Cell> level{{0, t.order.size()}};
  for (int depth = 0; !level.empty(); ++depth) {
    std::vector<Division> divisions(level.size());
    std::vector<std::uint64_t> seeds(level.size());
    for (std::uint64_t& seed : seeds) seed = random.next();
    if (depth < options.levels) {
      pool.for_each(level.size(), [&](std::size_t i) {
        divisions[i] = divide(t, level[i], options, Random(seeds[i]));
        counter.add(level[i].size());
      });
    }
    std::vector<Cell> next;
    for (std::size_t i = 0; i < level.size(); ++i) {
      const Division& d = divisions[i];
      content.child_count.push_back(static_cast<std::uint8_t>(d.cell.size()));
      content.descriptor.insert(content.descriptor.end(), d.centre.begin(), d.centre.end());
      next.insert(next.end(), d.cell.begin(), d.cell.end());
      if (d.cell.empty()) content.weight.push_back(inverse_document_frequency(t, level[i], images));
    }
    level = std::move(next);
  }
  return content;
}

}  // namespace

Result<VocabularyPtr> train_vocabulary(std::span<const std::vector<Descriptor>> images, const TrainingOptions& options,
                                       Random& random, ThreadPool& pool, const TrainingProgress& progress) {
  BSLAM_ASSERT(options.branching >= 2 && options.branching <= kMaxBranching, "branching must be 2 to kMaxBranching");
  BSLAM_ASSERT(options.levels >= 1 && options.levels <= kMaxLevels, "levels must be 1 to kMaxLevels");
  std::size_t count = 0;
  for (const auto& image : images) count += image.size();
  if (count > std::numeric_limits<std::int32_t>::max()) {
    return Error{"", "descriptors", std::to_string(count),
                 "at most 2^31 - 1 (fewer images or fewer features per image)"};
  }
  Training training = gather(images);
  const auto& all = training.descriptor;
  if (std::all_of(all.begin(), all.end(), [&](const Descriptor& d) { return d == all.front(); })) {
    return Error{"", "descriptors", all.empty() ? "none" : "all identical", "at least two distinct descriptors"};
  }
  return Vocabulary::make(grow(training, images.size(), options, random, pool, progress));
}

}  // namespace bslam::place
