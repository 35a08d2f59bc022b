// Seeded random descriptors and vocabularies for tests.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "base/random.h"
#include "place/vocabulary.h"

namespace bslam::place {

inline feature::Descriptor random_descriptor(Random& random) {
  return {random.next(), random.next(), random.next(), random.next()};
}

// Returns the descriptor with `bits` bits flipped.
inline feature::Descriptor with_flips(feature::Descriptor d, int bits, Random& random) {
  for (int i = 0; i < bits; ++i) {
    const std::uint32_t bit = random.below(256);
    d[bit / 64] ^= std::uint64_t{1} << (bit % 64);
  }
  return d;
}

// Returns a random tree: 2 to `branching` children per node, up to `levels` levels; some words are on higher levels.
inline VocabularyContent random_content(int branching, int levels, Random& random) {
  VocabularyContent c;
  c.branching = branching;
  c.levels = levels;
  std::size_t level_nodes = 1;
  for (int level = 0; level <= levels; ++level) {
    std::size_t next = 0;
    for (std::size_t i = 0; i < level_nodes; ++i) {
      const bool inner = level < levels && (level == 0 || random.below(8) > 0);
      const std::size_t children = inner ? 2 + random.below(static_cast<std::uint32_t>(branching - 1)) : 0;
      c.child_count.push_back(static_cast<std::uint8_t>(children));
      if (!inner) c.weight.push_back(static_cast<float>(random.uniform(0.5, 5.0)));
      next += children;
    }
    level_nodes = next;
  }
  for (std::size_t i = 1; i < c.child_count.size(); ++i) c.descriptor.push_back(random_descriptor(random));
  return c;
}

inline VocabularyPtr random_vocabulary(int branching, int levels, Random& random) {
  auto vocabulary = Vocabulary::make(random_content(branching, levels, random));
  EXPECT_TRUE(vocabulary.ok()) << vocabulary.error().message();
  return *vocabulary;
}

}  // namespace bslam::place
