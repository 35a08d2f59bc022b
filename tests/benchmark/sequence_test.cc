#include "benchmark/sequence.h"

#include <gtest/gtest.h>

#include "support/data_on_disk.h"

namespace bslam::benchmark {
namespace {

TEST(FindSequences, FindsEachFormatWithItsGroundTruth) {
  const support::TemporaryFolder folder;
  const auto& root = folder.path();
  support::write_text(root / "euroc/mav0/cam0/data.csv", "");
  support::write_text(root / "euroc/mav0/cam0/sensor.yaml", "");
  support::write_text(root / "euroc/mav0/state_groundtruth_estimate0/data.csv", "");
  support::write_text(root / "euroc/groundtruth_body.tum", "");
  support::write_text(root / "kitti/times.txt", "");
  support::write_text(root / "kitti/image_0/000000.png", "");
  support::write_text(root / "kitti/poses.txt", "");
  support::write_text(root / "tumvi/mav0/cam0/data.csv", "");
  support::write_text(root / "tumvi/mav0/mocap0/data.csv", "");
  support::write_text(root / "tumvi/dso/camchain.yaml", "");
  support::write_text(root / "without_truth/mav0/cam0/data.csv", "");
  support::write_text(root / "other/readme.txt", "");

  const auto found = find_sequences(root);
  ASSERT_TRUE(found.ok());
  ASSERT_EQ(found->size(), 4u);
  const Sequence &euroc = (*found)[0], &kitti = (*found)[1], &tumvi = (*found)[2];
  EXPECT_EQ(euroc.name, "euroc");
  ASSERT_TRUE(euroc.released && euroc.corrected);
  EXPECT_EQ(euroc.released->frame, TruthFrame::kBody);
  EXPECT_EQ(euroc.corrected->file.filename(), "groundtruth_body.tum");
  EXPECT_FALSE(euroc.rig);
  ASSERT_TRUE(kitti.released);
  EXPECT_EQ(kitti.released->frame, TruthFrame::kCamera0);
  EXPECT_EQ(kitti.released->times->filename(), "times.txt");
  ASSERT_TRUE(tumvi.released && tumvi.rig);
  EXPECT_EQ(tumvi.released->file.parent_path().filename(), "mocap0");
  EXPECT_EQ(tumvi.rig->filename(), "camchain.yaml");
  EXPECT_FALSE((*found)[3].released);
}

TEST(FindSequences, AFolderMayItselfBeASequence) {
  const support::TemporaryFolder folder;
  support::write_text(folder.path() / "MH_01_easy/mav0/cam0/data.csv", "");
  const auto found = find_sequences(folder.path() / "MH_01_easy/");
  ASSERT_TRUE(found.ok());
  ASSERT_EQ(found->size(), 1u);
  EXPECT_EQ(found->front().name, "MH_01_easy");
}

TEST(FindSequences, AFolderWithoutSequencesIsAnError) {
  const support::TemporaryFolder folder;
  EXPECT_FALSE(find_sequences(folder.path()).ok());
  EXPECT_FALSE(find_sequences(folder.path() / "missing").ok());
}

}  // namespace
}  // namespace bslam::benchmark
