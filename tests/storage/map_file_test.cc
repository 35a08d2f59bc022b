#include "storage/map_file.h"

#include <gtest/gtest.h>

#include "map/rigs_of_map.h"
#include "storage/map_sections.h"
#include "storage/small_map.h"
#include "storage/version_4_bytes.h"
#include "support/data_on_disk.h"
#include "synthetic/rigs.h"

namespace bslam::storage {
namespace {

namespace fs = std::filesystem;

SavedMap read_back(const map::BundledMap& map, const MapFileInfo& info = small_info()) {
  auto saved = map_from_bytes(map_to_bytes(map, info), "test");
  EXPECT_TRUE(saved) << saved.error().message();
  EXPECT_EQ(saved->map.check_invariants(), std::nullopt);
  return *std::move(saved);
}

void expect_same_bits(const geometry::SE3& a, const geometry::SE3& b) {
  EXPECT_EQ(a.rotation().coeffs(), b.rotation().coeffs());
  EXPECT_EQ(a.translation(), b.translation());
}

void expect_same_frame(const frame::BundledFrame& a, const frame::BundledFrame& b, bool with_words) {
  EXPECT_EQ(a.id, b.id);
  EXPECT_EQ(a.time_ns, b.time_ns);
  ASSERT_EQ(a.cameras.size(), b.cameras.size());
  for (std::size_t c = 0; c < a.cameras.size(); ++c) {
    const feature::Keypoints &ka = a.cameras[c].keypoints, &kb = b.cameras[c].keypoints;
    EXPECT_EQ(a.cameras[c].state, b.cameras[c].state);
    EXPECT_EQ(a.cameras[c].time_ns, b.cameras[c].time_ns);
    EXPECT_EQ(ka.pixel, kb.pixel);
    EXPECT_EQ(ka.level, kb.level);
    EXPECT_EQ(ka.angle, kb.angle);
    EXPECT_EQ(ka.sigma, kb.sigma);
    EXPECT_EQ(ka.bearing, kb.bearing);
    EXPECT_EQ(ka.descriptor, kb.descriptor);
    EXPECT_EQ(ka.patch, kb.patch);
    EXPECT_EQ(with_words ? a.cameras[c].words : SharedArray<WordId>(), b.cameras[c].words);
    std::vector<std::uint32_t> near_a, near_b;
    a.cameras[c].grid.near(ka, {300, 200}, 150, 0, 7, near_a);
    b.cameras[c].grid.near(kb, {300, 200}, 150, 0, 7, near_b);
    EXPECT_EQ(near_a, near_b);
  }
  ASSERT_EQ(a.bundled.size(), b.bundled.size());
  ASSERT_EQ(a.bundled.num_matched(), b.bundled.num_matched());
  for (std::size_t f = 0; f < a.bundled.size(); ++f) {
    const auto ra = a.bundled.keypoints(FeatureId(f)), rb = b.bundled.keypoints(FeatureId(f));
    EXPECT_TRUE(std::equal(ra.begin(), ra.end(), rb.begin(), rb.end()));
    const auto &pa = a.bundled.point(FeatureId(f)), &pb = b.bundled.point(FeatureId(f));
    ASSERT_EQ(pa.has_value(), pb.has_value());
    if (!pa) continue;
    EXPECT_EQ(pa->point_rig, pb->point_rig);
    EXPECT_EQ(pa->covariance, pb->covariance);
  }
}

// The n-th alive keyframe and landmark of one map correspond to number n of the other.
void expect_same_map(const map::BundledMap& a, const map::BundledMap& b, bool with_words = true) {
  const std::vector<KeyframeId> keyframes = a.keyframe_ids();
  const std::vector<LandmarkId> landmarks = a.landmark_ids();
  const auto number = [&](KeyframeId k) {
    return KeyframeId(std::ranges::find(keyframes, k) - keyframes.begin() + std::size_t{0});
  };
  ASSERT_EQ(b.keyframe_slots(), keyframes.size());
  ASSERT_EQ(b.landmark_slots(), landmarks.size());
  EXPECT_EQ(a.num_observations(), b.num_observations());
  EXPECT_EQ(a.scale(), b.scale());
  EXPECT_EQ(a.pyramid().levels, b.pyramid().levels);
  EXPECT_EQ(a.pyramid().scale_factor, b.pyramid().scale_factor);
  for (std::size_t i = 0; i < keyframes.size(); ++i) {
    const map::BundledKeyframe &ka = a.keyframe(keyframes[i]), &kb = b.keyframe(KeyframeId(i));
    expect_same_bits(ka.T_rig_world, kb.T_rig_world);
    EXPECT_EQ(ka.parent.valid() ? number(ka.parent) : KeyframeId(), kb.parent);
    expect_same_frame(*ka.frame, *kb.frame, with_words);
    ASSERT_EQ(ka.covisible.size(), kb.covisible.size());
    for (std::size_t n = 0; n < ka.covisible.size(); ++n) EXPECT_EQ(ka.covisible[n].weight, kb.covisible[n].weight);
  }
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    const map::Landmark &la = a.landmark(landmarks[i]), &lb = b.landmark(LandmarkId(i));
    EXPECT_EQ(la.position, lb.position);
    EXPECT_EQ(la.view_direction, lb.view_direction);
    EXPECT_EQ(la.min_distance, lb.min_distance);
    EXPECT_EQ(la.max_distance, lb.max_distance);
    EXPECT_EQ(la.descriptor, lb.descriptor);
    EXPECT_EQ(number(la.reference.keyframe), lb.reference.keyframe);
    EXPECT_EQ(la.reference.keypoint, lb.reference.keypoint);
    if (a.alive(la.born)) {
      EXPECT_EQ(number(la.born), lb.born);
    }
    EXPECT_EQ(la.expected, lb.expected);
    EXPECT_EQ(la.found, lb.found);
    const auto oa = a.observations(landmarks[i]), ob = b.observations(LandmarkId(i));
    ASSERT_EQ(oa.size(), ob.size());
    for (std::size_t n = 0; n < oa.size(); ++n)
      EXPECT_EQ((map::Observation{number(oa[n].keyframe), oa[n].feature, oa[n].aligned}), ob[n]);
  }
}

std::size_t words_end(const map::BundledMap& map) {
  std::size_t end = 0;
  for (const KeyframeId k : map.keyframe_ids()) {
    for (const frame::CameraFrame& c : map.keyframe(k).frame->cameras) {
      for (const WordId word : c.words) end = std::max(end, word.index() + 1);
    }
  }
  return end;
}

TEST(MapFile, RoundTripsTheMapBitwise) {
  for (const camera::Rig& rig :
       {synthetic::default_rig(), synthetic::mixed_rig(), synthetic::ring_rig(1), synthetic::fisheye_rig(3)}) {
    const map::BundledMap map = small_map(rig);
    ASSERT_GT(map.keyframe_slots(), map.num_keyframes());
    ASSERT_GT(map.landmark_slots(), map.num_landmarks());
    ASSERT_EQ(map.roots().size(), 2u);
    const SavedMap saved = read_back(map);
    expect_same_map(map, saved.map);
    EXPECT_EQ(saved.info.vocabulary, small_info().vocabulary);
    EXPECT_EQ(saved.info.version, "0.1.0");
    EXPECT_EQ(saved.info.data, "a recording");
    EXPECT_EQ(saved.words_end, words_end(map));
  }
}

TEST(MapFile, ReadsKeyframesAndLandmarksOfVersion4) {
  for (const camera::Rig& rig : {synthetic::default_rig(), synthetic::mixed_rig(), synthetic::ring_rig(1)}) {
    const map::BundledMap map = small_map(rig);
    for (const MapFileInfo& info : {small_info(), MapFileInfo{0, "0.1.0", ""}}) {
      const auto saved = map_from_bytes(version_4_bytes(map, info), "old");
      ASSERT_TRUE(saved) << saved.error().message();
      EXPECT_EQ(saved->map.check_invariants(), std::nullopt);
      expect_same_map(map, saved->map, info.vocabulary != 0);
      EXPECT_EQ(map_to_bytes(saved->map, info), map_to_bytes(map, info));
    }
  }
}

// Keyframes that are no longer new have some patches, and no points of features.
TEST(MapFile, RoundTripsKeyframesWithoutWhatTheyDoNotNeed) {
  map::BundledMap map = small_map(synthetic::default_rig());
  Random random(4, "empty keyframes");
  for (std::size_t i = 0; i < map::BundledMap::kNewKeyframes; ++i) {
    auto frame = std::make_shared<frame::BundledFrame>();
    frame->cameras.resize(map.rig().size());
    map.add_keyframe(std::move(frame), {}, {}, map.newest_keyframe());
  }
  const std::size_t whole = map_to_bytes(map, small_info()).size();
  map.release_unused(1000);
  ASSERT_FALSE(map.keypoints(KeyframeId(0), CameraIndex(0)).patch.complete());
  const SavedMap saved = read_back(map);
  expect_same_map(map, saved.map);
  const std::string bytes = map_to_bytes(saved.map, saved.info);
  EXPECT_EQ(bytes, map_to_bytes(map, small_info()));
  EXPECT_LT(bytes.size(), whole);
}

// A file that is large enough is mapped: its arrays are used where they are.
TEST(MapFile, UsesTheArraysOfALargeFileWhereTheyAre) {
  const support::TemporaryFolder folder;
  const fs::path file = folder.path() / "large.map";
  map::BundledMap map = small_map(synthetic::ring_rig(2), {.max_keypoints = 300});
  const KeyframeId first = map.keyframe_ids().front();
  while (map.num_keyframes() < 900) map.add_keyframe(map.keyframe(first).frame, {}, {}, map.newest_keyframe());
  ASSERT_TRUE(write_map(map, small_info(), file));
  ASSERT_GT(fs::file_size(file), std::size_t{64} << 20);
  const auto saved = read_map(file);
  ASSERT_TRUE(saved) << saved.error().message();
  ASSERT_TRUE(write_map(small_map(synthetic::ring_rig(1)), small_info(), file));  // replaces the file, not its bytes
  EXPECT_EQ(saved->map.check_invariants(), std::nullopt);
  MemoryCount whole, mapped;
  EXPECT_LT(10 * saved->map.memory(mapped).descriptors, map.memory(whole).descriptors + 1);
  const KeyframeId last = saved->map.newest_keyframe();
  expect_same_frame(*map.keyframe(map.newest_keyframe()).frame, *saved->map.keyframe(last).frame, true);
}

camera::Rig changed(const camera::Rig& rig, std::size_t i, const std::function<void(camera::RigCamera&)>& change) {
  std::vector<camera::RigCamera> cameras;
  for (std::size_t c = 0; c < rig.size(); ++c) cameras.push_back({rig.camera(c), rig.body_from_cam(c)});
  change(cameras[i]);
  return camera::Rig(std::move(cameras));
}

TEST(MapFile, RoundTripsTheRigBitwise) {
  camera::Rig rig = changed(synthetic::mixed_rig(), 1, [](camera::RigCamera& c) {
    c.camera.model = camera::DoubleSphere(camera::intrinsics(c.camera.model), -0.2, 0.6);
    c.camera.time_offset_ns = -1'234'567;
    c.camera.mask_file = "/masks/b.png";
  });
  const SavedMap saved = read_back(small_map(rig));
  const camera::Rig& back = saved.map.rig();
  ASSERT_EQ(back.size(), rig.size());
  for (std::size_t i = 0; i < rig.size(); ++i) {
    expect_same_bits(back.body_from_cam(i), rig.body_from_cam(i));
    expect_same_bits(back.cam_from_rig(i), rig.cam_from_rig(i));
    EXPECT_EQ(back.camera(i).name, rig.camera(i).name);
    EXPECT_EQ(back.camera(i).time_offset_ns, rig.camera(i).time_offset_ns);
    EXPECT_EQ(back.camera(i).mask_file, "");  // a path of one machine
    EXPECT_EQ(camera::model_name(back.camera(i).model), camera::model_name(rig.camera(i).model));
    EXPECT_EQ(camera::distortion(back.camera(i).model), camera::distortion(rig.camera(i).model));
    EXPECT_EQ(camera::intrinsics(back.camera(i).model).fx, camera::intrinsics(rig.camera(i).model).fx);
    EXPECT_EQ(back.camera(i).unproject({100, 50}), rig.camera(i).unproject({100, 50}));
  }
}

TEST(MapFile, DoesNotDependOnWhereMasksAre) {
  const auto with_mask = [](const std::string& file) {
    return map_to_bytes(
        small_map(changed(synthetic::mixed_rig(), 1, [&](camera::RigCamera& c) { c.camera.mask_file = file; })), {});
  };
  EXPECT_EQ(with_mask("/recordings/a/mask.png"), with_mask("/other/mask.png"));
}

TEST(MapFile, WarningsOfRunsAreJoined) {
  EXPECT_EQ(joined_warnings("", ""), "");
  EXPECT_EQ(joined_warnings("a", ""), "a");
  EXPECT_EQ(joined_warnings("", "b"), "b");
  EXPECT_EQ(joined_warnings("a", "b"), "a; b");
  EXPECT_EQ(joined_warnings("a; b", "b"), "a; b");
}

TEST(MapFile, KeepsTheMovesOfCameras) {
  const geometry::SE3 T(Eigen::Quaterniond(0.99, 0.1, 0.02, -0.03).normalized(), Eigen::Vector3d(0.001, 0.002, -0.003));
  const camera::Rig rig = synthetic::ring_rig(2).with_moves({{1, 500'000'000, T}});
  map::BundledMap map = small_map(rig);
  ASSERT_EQ(map.given_rig().moves().size(), 1u);
  const SavedMap saved = read_back(map);
  expect_same_map(map, saved.map);
  ASSERT_EQ(saved.map.rig().moves().size(), 1u);
  EXPECT_EQ(saved.map.rig().moves()[0].camera, 1u);
  EXPECT_EQ(saved.map.rig().moves()[0].time_ns, 500'000'000);
  expect_same_bits(saved.map.rig().moves()[0].T_after_initial, T);
  // A further recording begins with the rig as it is after the moves.
  const camera::Rig again = synthetic::ring_rig(2);
  EXPECT_EQ(map::find_or_append_rig(map, again), 2u);
  EXPECT_LT((map.rig().cam_from_rig(3).matrix() - (T * rig.cam_from_rig(1)).matrix()).norm(), 1e-12);
  EXPECT_EQ(map.rig().moves().size(), 1u);
  EXPECT_EQ(map::find_or_append_rig(map, again), 2u);
}

TEST(MapFile, RoundTripsPosesThatNormalisationWouldChange) {
  Random random(5);
  map::BundledMap map(std::make_shared<const camera::Rig>(synthetic::ring_rig(1)));
  std::size_t changeable = 0;
  for (int i = 0; i < 2000; ++i) {
    geometry::Vector6d xi;
    for (int n = 0; n < 6; ++n) xi[n] = random.uniform(-2, 2);
    auto frame = std::make_shared<frame::BundledFrame>();
    frame->cameras.resize(1);
    const geometry::SE3 T_rig_world = geometry::SE3::exp(xi) * geometry::SE3::exp(-0.3 * xi).inverse();
    changeable += T_rig_world.rotation().normalized().coeffs() != T_rig_world.rotation().coeffs();
    map.add_keyframe(std::move(frame), T_rig_world, {}, {});
  }
  ASSERT_GT(changeable, 20u);
  const SavedMap saved = read_back(map);
  for (const KeyframeId k : map.keyframe_ids())
    expect_same_bits(saved.map.keyframe(k).T_rig_world, map.keyframe(k).T_rig_world);
}

TEST(MapFile, IsIdenticalWhenWrittenAgain) {
  const support::TemporaryFolder folder;
  const fs::path a = folder.path() / "a.map", b = folder.path() / "b.map";
  ASSERT_TRUE(write_map(small_map(synthetic::default_rig()), small_info(), a));
  const auto saved = read_map(a);
  ASSERT_TRUE(saved) << saved.error().message();
  EXPECT_EQ(saved->file, a.string());
  ASSERT_TRUE(write_map(saved->map, saved->info, b));
  EXPECT_TRUE(support::read_text(a) == support::read_text(b));
}

TEST(MapFile, RoundTripsAnEmptyMap) {
  const map::BundledMap map(std::make_shared<const camera::Rig>(synthetic::ring_rig(2)));
  const SavedMap saved = read_back(map);
  EXPECT_EQ(saved.map.keyframe_slots(), 0u);
  EXPECT_EQ(saved.words_end, 0u);
}

TEST(MapFile, OmitsWordsWithoutAVocabulary) {
  const map::BundledMap map = small_map(synthetic::default_rig());
  const SavedMap saved = read_back(map, {0, "0.1.0", ""});
  expect_same_map(map, saved.map, false);
  EXPECT_EQ(saved.words_end, 0u);
}

TEST(MapFile, RejectsOtherFiles) {
  const support::TemporaryFolder folder;
  const auto rejected = [&](std::string_view content) {
    support::write_text(folder.path() / "file", content);
    const auto saved = read_map(folder.path() / "file");
    EXPECT_FALSE(saved);
    EXPECT_EQ(saved.error().file, (folder.path() / "file").string());
    return saved.error();
  };
  EXPECT_EQ(rejected("").found, "a file of another format");
  EXPECT_EQ(rejected("PNG and so on").found, "a file of another format");
  EXPECT_EQ(rejected("BSLAMMAP").key, "header");
  std::string bytes = map_to_bytes(small_map(synthetic::ring_rig(1)), small_info());
  EXPECT_EQ(rejected(bytes + "x").key, "size");
  bytes[12] = 99;
  EXPECT_EQ(rejected(bytes).key, "format version");
  EXPECT_EQ(rejected(bytes).found, "99");
  EXPECT_FALSE(read_map(folder.path() / "none"));
  EXPECT_FALSE(read_map(folder.path()));
}

TEST(MapFile, IsWrittenCompletelyOrNotAtAll) {
  const support::TemporaryFolder folder;
  const map::BundledMap map = small_map(synthetic::ring_rig(1));
  EXPECT_FALSE(write_map(map, small_info(), folder.path() / "no" / "folder.map"));
  ASSERT_TRUE(write_map(map, small_info(), folder.path() / "a.map"));
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), {}), 1);
}

// ---- fits

TEST(MapFits, OnlyTheVocabularyOfItsKeyframes) {
  place::VocabularyContent content;
  content.branching = 2;
  content.levels = 1;
  content.child_count = {2, 0, 0};
  content.descriptor = {{1, 2, 3, 4}, {5, 6, 7, 8}};
  content.weight = {1, 1};
  const auto vocabulary = place::Vocabulary::make(content);
  ASSERT_TRUE(vocabulary);
  const map::BundledMap map = small_map(synthetic::ring_rig(1));
  EXPECT_EQ(fits(read_back(map), map.pyramid(), vocabulary->get()).error().key, "vocabulary");
  EXPECT_TRUE(fits(read_back(map, {0, "", ""}), map.pyramid(), vocabulary->get()));
  // The id of the vocabulary is correct, but the keyframes contain words that it does not have.
  EXPECT_EQ(fits(read_back(map, {(*vocabulary)->id(), "", ""}), map.pyramid(), vocabulary->get()).error().key,
            "vocabulary");
}

TEST(MapFile, KeepsTheWarningOfItsRun) {
  const map::BundledMap map = small_map(synthetic::ring_rig(1));
  const SavedMap saved = read_back(map, {0, "", "", "the images do not belong to the calibration"});
  EXPECT_EQ(saved.info.warning, "the images do not belong to the calibration");
  EXPECT_EQ(read_back(map).info.warning, "");
}

// ---- rigs

TEST(MapFile, KeepsTheGivenCalibrationAndFurtherRigs) {
  const camera::Rig rig = synthetic::ring_rig(2);
  map::BundledMap map = small_map(rig);
  const camera::Rig given = changed(rig, 1, [](camera::RigCamera& c) { c.camera.width += 2; });
  map.set_given_rig(std::make_shared<const camera::Rig>(given));
  EXPECT_EQ(map::find_or_append_rig(map, synthetic::fisheye_rig(3)), 2u);
  const SavedMap saved = read_back(map);
  expect_same_map(map, saved.map);
  EXPECT_EQ(saved.map.given_rig().camera(1).width, rig.camera(1).width + 2);
  EXPECT_EQ(map::find_rig(saved.map, rig), 0u);
  EXPECT_EQ(map::find_rig(saved.map, given), 0u);
  EXPECT_EQ(map::find_rig(saved.map, rig.subset(std::vector<int>{0})), 0u);
  EXPECT_EQ(map::find_rig(saved.map, synthetic::fisheye_rig(3)), 2u);
  EXPECT_FALSE(map::find_rig(saved.map, rig.subset(std::vector<int>{1})));
  EXPECT_FALSE(map::find_rig(saved.map, synthetic::fisheye_rig(2)));
}

// Cameras whose names are taken get other names in the map, but are still known by those that they were given.
TEST(MapFile, KnowsCamerasByTheNamesThatTheyWereGiven) {
  map::BundledMap map = small_map(synthetic::ring_rig(2));
  const camera::Rig wide = synthetic::fisheye_rig(1);
  const camera::Camera& camera = wide.camera(0);
  const auto named = [&](std::string first, std::string second) {
    camera::Camera a = camera, b = camera;
    a.name = std::move(first);
    b.name = std::move(second);
    const geometry::SE3 T(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.2, 0, 0));
    return camera::Rig({{a, geometry::SE3()}, {b, T}});
  };
  EXPECT_EQ(map::find_or_append_rig(map, named("cam0", "cam0_left")), 2u);
  const map::BundledMap saved = read_back(map).map;
  EXPECT_EQ(saved.rig().camera(2).name, "cam2");
  EXPECT_EQ(saved.given_rig().camera(2).name, "cam0");
  EXPECT_EQ(map::find_rig(saved, named("cam0", "cam0_left")), 2u);
  EXPECT_EQ(map::find_rig(saved, named("cam0", "another")), 2u);
  EXPECT_FALSE(map::find_rig(saved, named("cam0_left", "cam0")));  // exchanged
}

TEST(MapFile, ReadsTheRigsOfEarlierVersions) {
  const map::BundledMap map = small_map(synthetic::ring_rig(2));
  const std::string bytes = rigs_of_version_5(map);
  const std::string filled_up = bytes + std::string((8 - bytes.size() % 8) % 8, '\0');
  SectionReader of_version_5(filled_up, "rig");
  ASSERT_TRUE(take_rigs(of_version_5, 5)) << of_version_5.error().message();
  constexpr std::size_t kCount = 4, kReadouts = 2 * sizeof(double), kTransform = 7 * sizeof(double);
  const std::size_t one = (bytes.size() - kCount) / 2, without_frame = one - kTransform;
  for (const std::size_t size : {without_frame - kReadouts, without_frame}) {  // version 2: readout times are optional
    SectionReader in(std::string_view(bytes).substr(0, kCount + size), "rig");
    const auto rigs = take_rigs(in, 2);
    ASSERT_TRUE(rigs) << in.error().message();
    EXPECT_TRUE(rigs->rig->same_calibration(map.rig()));
    EXPECT_EQ(rigs->given, rigs->rig);
  }
  const std::string version3 = bytes.substr(0, kCount + without_frame) + bytes.substr(kCount + one, without_frame);
  SectionReader in(version3, "rig");
  const auto rigs = take_rigs(in, 3);
  ASSERT_TRUE(rigs) << in.error().message();
  EXPECT_TRUE(rigs->given->same_calibration(map.given_rig()));
}

TEST(MapFile, ACameraIsNotAnotherOneOfTheSameCalibration) {
  const camera::Rig rig = synthetic::ring_rig(2);
  const camera::Camera& left = rig.camera(0);
  std::vector<camera::RigCamera> twins = {{left, rig.body_from_cam(0)}, {left, rig.body_from_cam(1)}};
  twins[1].camera.name = "right";
  const camera::Rig stereo(std::move(twins));
  const map::BundledMap map = small_map(stereo);
  EXPECT_EQ(map::find_rig(map, stereo.subset(std::vector<int>{0})), 0u);
  EXPECT_FALSE(map::find_rig(map, stereo.subset(std::vector<int>{1})));
  const auto found = map::find_cameras(map, stereo.subset(std::vector<int>{1}));
  EXPECT_EQ(found, (std::vector<std::optional<std::size_t>>{std::nullopt, 0}));
}

// A map of some cameras of a recording, or a recording with some cameras of a map, in another order.
TEST(MapFile, KnowsWhichCamerasOfItAreThoseOfARecording) {
  using Cameras = std::vector<std::optional<std::size_t>>;
  const camera::Rig ring = synthetic::ring_rig(4);
  const auto part = [&ring](const std::vector<int>& cameras) { return ring.subset(cameras); };
  map::BundledMap map = small_map(ring);
  EXPECT_EQ(map::find_cameras(map, part({2, 0})), (Cameras{1, {}, 0, {}}));
  map = small_map(part({0, 2}));
  EXPECT_EQ(map::find_cameras(map, ring), (Cameras{0, 2}));
  EXPECT_EQ(map::find_rig(map, part({3, 1})), std::nullopt);
  map::find_or_append_rig(map, part({3, 1}));
  EXPECT_EQ(map::find_cameras(map, ring), (Cameras{0, 2, 3, 1}));
  EXPECT_EQ(map::find_cameras(map, synthetic::fisheye_rig(4)), Cameras(4));
  const camera::Rig moved = changed(ring, 2, [](camera::RigCamera& c) {
    c.T_body_cam = c.T_body_cam * geometry::SE3(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.1, 0, 0));
  });
  EXPECT_EQ(map::find_cameras(map, moved), (Cameras{{}, {}, 3, 1}));
}

// Distances between cameras are in metres, and mean nothing in a map with a unit of its own.
TEST(MapFile, OfAnotherScaleIsContinuedByItsOwnRigOrCamerasInOnePlaceOnly) {
  const camera::Rig rig = synthetic::ring_rig(2), other = synthetic::fisheye_rig(2);
  const auto alone = [](const camera::Rig& whole, int c) { return whole.subset(std::vector<int>{c}); };
  std::vector<camera::RigCamera> turned;
  for (std::size_t c = 0; c < rig.size(); ++c)
    turned.push_back({other.camera(c), geometry::SE3(rig.body_from_cam(c).rotation(), Eigen::Vector3d(1, 2, 3))});
  map::BundledMap map = small_map(rig);
  const auto checked = [&map](const camera::Rig& r) {
    return check_continued(read_back(map), r, map.pyramid(), nullptr);
  };
  for (const map::Scale scale : {map::Scale::kUpToScale, map::Scale::kUnobservable}) {
    map.set_scale(scale);
    ASSERT_FALSE(checked(other));
    EXPECT_EQ(checked(other).error().key, "scale");
    EXPECT_EQ(bool(checked(rig)), scale == map::Scale::kUnobservable);  // one camera made the map that is up to scale
    EXPECT_TRUE(checked(camera::Rig(turned)));
    for (const int c : {0, 1}) EXPECT_TRUE(checked(alone(rig, c)) && checked(alone(other, c))) << c;
  }
  map.set_scale(map::Scale::kMetric);
  EXPECT_TRUE(checked(other));
}

TEST(MapFile, KeepsTheRigFrameOfARefinedCalibration) {
  const camera::Rig rig = synthetic::ring_rig(2);
  map::BundledMap map = small_map(rig);
  map.set_given_rig(std::make_shared<const camera::Rig>(rig));
  const geometry::SE3 T_cam0_rig(geometry::so3_exp({0.01, 0.02, 0}), Eigen::Vector3d::Zero());
  std::vector<camera::RigCamera> cameras;
  for (std::size_t c = 0; c < rig.size(); ++c) cameras.push_back({rig.camera(c), rig.body_from_cam(c)});
  map.set_rig(std::make_shared<const camera::Rig>(std::move(cameras), T_cam0_rig), {});
  const SavedMap saved = read_back(map);
  EXPECT_EQ(saved.map.rig().cam_from_rig(0).matrix(), map.rig().cam_from_rig(0).matrix());
  EXPECT_EQ(saved.map.rig().cam_from_rig(1).matrix(), map.rig().cam_from_rig(1).matrix());
  EXPECT_EQ(map::find_rig(saved.map, rig), 0u);
  EXPECT_EQ(map::find_rig(saved.map, map.rig()), 0u);  // as a rig file of the refined calibration has it
}

}  // namespace
}  // namespace bslam::storage
