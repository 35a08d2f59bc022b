#include "place/majority_clustering.h"

#include <algorithm>
#include <array>
#include <numeric>

#include "base/assert.h"
#include "feature/hamming.h"

namespace bslam::place {
namespace {

using feature::Descriptor;

// Counts the set bits of descriptors at each bit position. Eight one-byte counters are packed into one 64-bit number
// and flushed into wide counters before they overflow, which takes 32 instead of 256 additions per descriptor.
class BitCounter {
 public:
  void add(const Descriptor& d) {
    if (pending_ == 255) flush();
    for (std::size_t byte = 0; byte < kBytes; ++byte)
      narrow_[byte] += kSpread[(d[byte / 8] >> (8 * (byte % 8))) & 0xff];
    ++pending_;
    ++members_;
  }

  std::uint32_t members() const { return members_; }

  Descriptor majority(const Descriptor& tie) {
    flush();
    Descriptor result{};
    for (std::size_t bit = 0; bit < wide_.size(); ++bit) {
      const std::uint64_t twice = std::uint64_t{2} * wide_[bit];
      const std::uint64_t old = (tie[bit / 64] >> (bit % 64)) & 1;
      const std::uint64_t set = twice == members_ ? old : static_cast<std::uint64_t>(twice > members_);
      result[bit / 64] |= set << (bit % 64);
    }
    return result;
  }

 private:
  static constexpr std::size_t kBytes = sizeof(Descriptor);

  // Entry v holds bit i of v in byte i.
  static constexpr std::array<std::uint64_t, 256> kSpread = [] {
    std::array<std::uint64_t, 256> spread{};
    for (std::size_t v = 0; v < spread.size(); ++v) {
      for (std::size_t i = 0; i < 8; ++i) spread[v] |= static_cast<std::uint64_t>((v >> i) & 1) << (8 * i);
    }
    return spread;
  }();

  void flush() {
    for (std::size_t bit = 0; bit < wide_.size(); ++bit) {
      wide_[bit] += static_cast<std::uint32_t>((narrow_[bit / 8] >> (8 * (bit % 8))) & 0xff);
    }
    narrow_.fill(0);
    pending_ = 0;
  }

  std::array<std::uint64_t, kBytes> narrow_{};
  std::array<std::uint32_t, 8 * kBytes> wide_{};
  std::uint32_t pending_ = 0, members_ = 0;
};

std::vector<Descriptor> seed_centres(std::span<const Descriptor> descriptors, int k, Random& random) {
  std::vector<Descriptor> centres{descriptors[random.below(static_cast<std::uint32_t>(descriptors.size()))]};
  std::vector<std::uint32_t> distance(descriptors.size(), 256);
  while (centres.size() < static_cast<std::size_t>(k)) {
    std::uint64_t sum = 0;
    for (std::size_t i = 0; i < descriptors.size(); ++i) {
      distance[i] = std::min(distance[i], static_cast<std::uint32_t>(feature::hamming(descriptors[i], centres.back())));
      sum += distance[i];
    }
    if (sum == 0) break;  // every descriptor is already a centre
    std::uint64_t draw = std::min(sum - 1, static_cast<std::uint64_t>(random.uniform() * static_cast<double>(sum)));
    std::size_t chosen = 0;
    while (draw >= distance[chosen]) draw -= distance[chosen++];
    centres.push_back(descriptors[chosen]);
  }
  return centres;
}

// Assigns each descriptor to its nearest centre. Returns true if any assignment changed.
bool assign(std::span<const Descriptor> descriptors, Clusters& clusters) {
  bool changed = false;
  for (std::size_t i = 0; i < descriptors.size(); ++i) {
    std::uint32_t best = ~0u;
    for (std::size_t c = 0; c < clusters.centre.size(); ++c) {
      const auto distance = static_cast<std::uint32_t>(feature::hamming(descriptors[i], clusters.centre[c]));
      best = std::min(best, (distance << 8) | static_cast<std::uint32_t>(c));
    }
    const auto cluster = static_cast<std::uint8_t>(best & 0xff);
    changed |= clusters.of[i] != cluster;
    clusters.of[i] = cluster;
  }
  return changed;
}

std::size_t farthest_from_its_centre(std::span<const Descriptor> descriptors, const Clusters& clusters) {
  std::size_t farthest = 0;
  int most = -1;
  for (std::size_t i = 0; i < descriptors.size(); ++i) {
    const int distance = feature::hamming(descriptors[i], clusters.centre[clusters.of[i]]);
    if (distance > most) {
      most = distance;
      farthest = i;
    }
  }
  return farthest;
}

void move_centres(std::span<const Descriptor> descriptors, Clusters& clusters) {
  std::vector<BitCounter> counters(clusters.centre.size());
  for (std::size_t i = 0; i < descriptors.size(); ++i) counters[clusters.of[i]].add(descriptors[i]);
  for (std::size_t c = 0; c < counters.size(); ++c) {
    if (counters[c].members() > 0) clusters.centre[c] = counters[c].majority(clusters.centre[c]);
  }
  for (std::size_t c = 0; c < counters.size(); ++c) {
    if (counters[c].members() > 0) continue;
    const std::size_t farthest = farthest_from_its_centre(descriptors, clusters);
    clusters.centre[c] = descriptors[farthest];
    clusters.of[farthest] = static_cast<std::uint8_t>(c);
  }
}

// Removes clusters without members. The assignments stay valid, since an empty cluster is no descriptor's nearest
// centre.
void drop_empty(Clusters& clusters) {
  std::vector<bool> used(clusters.centre.size());
  for (const std::uint8_t c : clusters.of) used[c] = true;
  std::vector<std::uint8_t> renamed(used.size());
  std::size_t kept = 0;
  for (std::size_t c = 0; c < used.size(); ++c) {
    if (!used[c]) continue;
    renamed[c] = static_cast<std::uint8_t>(kept);
    clusters.centre[kept++] = clusters.centre[c];
  }
  clusters.centre.resize(kept);
  for (std::uint8_t& c : clusters.of) c = renamed[c];
}

}  // namespace

Descriptor majority(std::span<const Descriptor> descriptors, const Descriptor& tie) {
  BitCounter counter;
  for (const Descriptor& d : descriptors) counter.add(d);
  return counter.majority(tie);
}

Clusters cluster_by_majority(std::span<const Descriptor> descriptors, int k, int iterations, Random& random) {
  BSLAM_ASSERT(!descriptors.empty() && k >= 2 && k <= 64, "there must be descriptors, and k must be 2 to 64");
  Clusters clusters{seed_centres(descriptors, k, random), std::vector<std::uint8_t>(descriptors.size(), 0xff)};
  assign(descriptors, clusters);
  for (int i = 0; i < iterations; ++i) {
    move_centres(descriptors, clusters);
    if (!assign(descriptors, clusters)) break;
  }
  drop_empty(clusters);
  return clusters;
}

}  // namespace bslam::place
