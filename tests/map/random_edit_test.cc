#include <gtest/gtest.h>

#include "synthetic_map.h"

namespace bslam::map {
namespace {

std::string violation(const BundledMap& map) { return map.check_invariants().value_or("valid"); }

TEST(RandomEdits, KeepTheInvariants) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    MapStore store{BundledMap(synthetic_rig(2))};
    RandomEditor editor(seed);
    for (int batch = 0; batch < 150; ++batch) {
      MapDraft draft(store.snapshot());
      for (int i = 0; i < 40; ++i) editor.change(draft);
      const CommitReport report = store.commit(std::move(draft));
      ASSERT_FALSE(report.rebased);
      ASSERT_EQ(violation(*report.published), "valid") << "seed " << seed << ", batch " << batch;
    }
    EXPECT_GT(store.snapshot()->num_landmarks(), 20u);
    EXPECT_GT(store.snapshot()->keyframe_slots(), store.snapshot()->num_keyframes() + 20);
  }
}

TEST(RandomEdits, DoNotChangeOldSnapshots) {
  MapStore store{BundledMap(synthetic_rig(2))};
  RandomEditor editor(5);
  std::vector<std::pair<MapSnapshot, Fingerprint>> kept;
  for (int batch = 0; batch < 60; ++batch) {
    kept.emplace_back(store.snapshot(), Fingerprint(*store.snapshot()));
    MapDraft draft(store.snapshot());
    for (int i = 0; i < 30; ++i) editor.change(draft);
    store.commit(std::move(draft));
  }
  for (const auto& [snapshot, fingerprint] : kept) EXPECT_TRUE(Fingerprint(*snapshot) == fingerprint);
}

TEST(RandomEdits, AreReproducibleWhenAppliedToTheirBase) {
  MapStore store{BundledMap(synthetic_rig(2))};
  RandomEditor editor(6);
  for (int batch = 0; batch < 60; ++batch) {
    MapDraft draft(store.snapshot());
    for (int i = 0; i < 40; ++i) editor.change(draft);
    auto [edit, result] = MapDraft(draft).finish();
    BundledMap again = *edit.base;
    const RebaseReport report = rebase(edit, again);
    EXPECT_EQ(report.dropped, 0u);
    ASSERT_TRUE(Fingerprint(again) == Fingerprint(result)) << "batch " << batch;
    store.commit(std::move(draft));
  }
}

TEST(RandomEdits, KeepTheInvariantsWhenRebased) {
  MapStore store{BundledMap(synthetic_rig(2))};
  RandomEditor editor(8);
  for (int batch = 0; batch < 100; ++batch) {
    std::vector<MapDraft> drafts;
    for (int d = 0; d < 3; ++d) {
      drafts.emplace_back(store.snapshot());
      for (int i = 0; i < 25; ++i) editor.change(drafts.back());
    }
    for (std::size_t d = 0; d < drafts.size(); ++d) {
      const CommitReport report = store.commit(std::move(drafts[d]));
      EXPECT_EQ(report.rebased || report.rejected, d > 0);
      ASSERT_EQ(violation(*report.published), "valid") << "batch " << batch << ", draft " << d;
      for (const KeyframeId k : report.keyframes) EXPECT_TRUE(report.published->keyframe_slots() > k.index());
    }
  }
}

}  // namespace
}  // namespace bslam::map
