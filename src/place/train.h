// Training of a vocabulary by hierarchical k-majority clustering of binary descriptors (k-majority: Grana et al., 2013;
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
  int branching = 10;   // children per node; 10 on 5 levels gives up to 10^5 words
  int levels = 5;       // steps from the root to a word
  int iterations = 12;  // maximum number of iterations per clustering; most converge earlier

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor& visitor) {
    visitor("branching", self.branching, Range{2, kMaxBranching}, "",
            "maximum number of children per node of the tree");
    visitor("levels", self.levels, Range{1, kMaxLevels}, "", "steps from the root to a word");
    visitor("iterations", self.iterations, Range{1, 1000}, "", "maximum number of iterations per clustering");
  }
};

// Reports the number of processed descriptors times levels and the total of that number. Called from the threads of the
// pool, one call at a time.
using TrainingProgress = std::function<void(std::size_t done, std::size_t all)>;

// Trains a vocabulary from images, each given by the descriptors of its keypoints. The result depends on the images,
// their order, the options and the generator, but not on the number of threads. The weight of a word is its inverse
// document frequency log((images + 1) / images that contain it); the added 1 keeps the weight of a word contained in
// every image positive. Errors: no descriptors, fewer than two distinct ones, or more than 2^31 - 1.
Result<VocabularyPtr> train_vocabulary(std::span<const std::vector<feature::Descriptor>> images,
                                       const TrainingOptions& options, Random& random, ThreadPool& pool,
                                       const TrainingProgress& progress = {});

}  // namespace bslam::place
