// Training of a vocabulary: hierarchical clustering of binary descriptors by majority (k-majority: Grana et al., 2013;
// hierarchical: Galvez-Lopez and Tardos, T-RO 2012).
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "base/options.h"
#include "base/random.h"
#include "base/result.h"
#include "base/thread_pool.h"
#include "place/vocabulary.h"

namespace bslam::place {

struct TrainingOptions {
  int branching = 10;   // children of a node; 10 on 5 levels make up to 10^5 words
  int levels = 5;       // steps from the root to a word
  int iterations = 12;  // of one clustering; most have settled before

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("branching", self.branching, Range{2, kMaxBranching}, "", "children of a node of the tree");
    visitor("levels", self.levels, Range{1, kMaxLevels}, "", "steps from the root to a word");
    visitor("iterations", self.iterations, Range{1, 1000}, "", "most iterations of one clustering");
  }
};

// Descriptors and levels done, of all; called from the threads of the pool, one call at a time.
using TrainingProgress = std::function<void(std::size_t done, std::size_t all)>;

// The vocabulary of these images, each given by the descriptors of its keypoints. Depends on the images, their order,
// the options and the generator alone, not on the threads. A word's weight is log((images + 1) / images that show it):
// the one more lets a word that all show keep some weight. Errors: no descriptors at all, fewer than two different
// ones, or more than 2^31 - 1.
Result<VocabularyPtr> train_vocabulary(std::span<const std::vector<feature::Descriptor>> images,
                                       const TrainingOptions& options, Random& random, ThreadPool& pool,
                                       const TrainingProgress& progress = {});

}  // namespace bslam::place
