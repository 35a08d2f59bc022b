// Two edits that start from the same version of a small map, for the tests of the rebase rules.
#pragma once

#include <gtest/gtest.h>

#include <optional>
#include <utility>
#include <vector>

#include "map/map_store.h"
#include "synthetic_map.h"

namespace bslam::map {

using Matches = std::vector<std::pair<FeatureId, LandmarkId>>;

constexpr KeyframeId kRoot{0}, kSecond{1}, kThird{2};

// Keyframes 0, 1, 2 form a chain; landmark i < 30 is observed by all of them with feature i. `early` and `late` start
// from the same version, and `early` is committed first.
class RebaseTest : public testing::Test {
 protected:
  RebaseTest() {
    MapDraft draft(store.snapshot());
    add_keyframe(draft, {});
    for (std::size_t i = 0; i < 30; ++i) draft.add_landmark(random_point(random), {{kRoot, FeatureId(i)}});
    for (int i = 0; i < 2; ++i) add_keyframe(draft, same_numbers(0, 30));
    store.commit(std::move(draft));
    early.emplace(store.snapshot());
    late.emplace(store.snapshot());
  }

  static Matches same_numbers(std::size_t from, std::size_t to) {
    Matches list;
    for (std::size_t i = from; i < to; ++i) list.emplace_back(FeatureId(i), LandmarkId(i));
    return list;
  }
  KeyframeId add_keyframe(MapDraft& draft, Matches list, KeyframeId fallback = {}) {
    return draft.add_keyframe(synthetic_frame(random, 2, 30, 10), random_pose(random, 0.5), std::move(list), fallback);
  }
  // Adds a submap of one keyframe to the version on which both drafts are based.
  KeyframeId begin_submap() {
    MapDraft setup(store.snapshot());
    const KeyframeId root = add_keyframe(setup, {});
    store.commit(std::move(setup));
    early.emplace(store.snapshot());
    late.emplace(store.snapshot());
    return root;
  }
  // Commits both drafts and returns the report of the late one.
  CommitReport commit() {
    store.commit(*std::move(early));
    CommitReport report = store.commit(*std::move(late));
    EXPECT_TRUE(report.rebased || report.rejected);
    EXPECT_EQ(report.published->check_invariants().value_or("valid"), "valid");
    return report;
  }

  static void expect_near(const geometry::SE3& a, const geometry::SE3& b) {
    EXPECT_LT((a.inverse() * b).log().norm(), 1e-10);
  }

  Random random{3, "rebase test"};
  MapStore store{BundledMap(synthetic_rig(2))};
  std::optional<MapDraft> early, late;
};

}  // namespace bslam::map
