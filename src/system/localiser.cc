#include "system/localiser.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <stdexcept>
#include <utility>

#include "map/rigs_of_map.h"
#include "system/cameras_of_run.h"
#include "system/input_check.h"
#include "system/pipeline.h"
#include "system/relocaliser.h"
#include "tracking/map_doubt.h"

namespace bslam::system {
namespace {

Config config_to_localise(Config config) {
  config.localize_only = true;
  config.mode = execution::Mode::kSequential;
  return without_calibration(std::move(config));
}

// Returns the same version of the map for every frame, and changes nothing.
class FixedMap final : public execution::StageExecutor {
 public:
  explicit FixedMap(map::MapSnapshot map) : map_(std::move(map)) {}

  map::MapSnapshot begin_frame(FrameId, TimeNs) override { return map_; }
  map::CommitReport commit(execution::JournalStep, map::MapDraft) override {
    throw std::logic_error("localisation does not change the map");
  }
  void note_reduction(int) override {}
  void enqueue(const execution::StageTask&) override {}
  void drain() override {}
  void restart() override {}
  void interrupt() override {}
  bool over() const override { return true; }

 private:
  const map::MapSnapshot map_;
};

// One index of places for all threads. Queries are short and take turns; the geometric verification runs in parallel.
class SharedPlaces final : public looping::PlaceRecogniser {
 public:
  SharedPlaces(place::VocabularyPtr vocabulary, const looping::RecognitionOptions& options)
      : recogniser_(std::move(vocabulary), options) {}

  void describe(frame::BundledFrame& frame) const override { recogniser_.describe(frame); }
  std::vector<looping::PlaceCandidate> query_keyframe(const map::BundledMap& map, KeyframeId keyframe) override {
    const std::lock_guard lock(mutex_);
    return recogniser_.query_keyframe(map, keyframe);
  }
  std::vector<looping::PlaceCandidate> query_frame(const map::BundledMap& map,
                                                   const frame::BundledFrame& frame) override {
    const std::lock_guard lock(mutex_);
    return recogniser_.query_frame(map, frame);
  }
  std::size_t memory_bytes() const override { return recogniser_.memory_bytes(); }

 private:
  std::mutex mutex_;
  looping::BagOfWordsRecogniser recogniser_;
};

// The interface of one thread to the shared index.
class PlacesOfThread final : public looping::PlaceRecogniser {
 public:
  explicit PlacesOfThread(std::shared_ptr<looping::PlaceRecogniser> places) : places_(std::move(places)) {}

  void describe(frame::BundledFrame& frame) const override { places_->describe(frame); }
  std::vector<looping::PlaceCandidate> query_keyframe(const map::BundledMap& map, KeyframeId keyframe) override {
    return places_->query_keyframe(map, keyframe);
  }
  std::vector<looping::PlaceCandidate> query_frame(const map::BundledMap& map,
                                                   const frame::BundledFrame& frame) override {
    return places_->query_frame(map, frame);
  }

 private:
  const std::shared_ptr<looping::PlaceRecogniser> places_;
};

// The frame with the image of this camera only.
image::ImageBundle with_one_image(const image::ImageBundle& images, std::size_t camera) {
  image::ImageBundle out;
  out.time_ns = images.time_ns;
  out.images.resize(images.images.size());
  out.images[camera] = images.images[camera];
  return out;
}

// Whether two poses of frames that were located in the map differ by more than their errors explain. The deviations of
// the poses do not include the errors of the calibration.
bool differ(const map::BundledMap& map, const tracking::TrackResult& a, const tracking::TrackResult& b) {
  constexpr double kMaxSigmas = 10;
  if (map.root_of(a.anchored.reference) != map.root_of(b.anchored.reference)) return true;
  if (!a.covariance || !b.covariance) return false;
  const geometry::Vector6d difference = (a.T_rig_world * b.T_rig_world.inverse()).log();
  const geometry::Matrix6d covariance = *a.covariance + *b.covariance;
  return difference.dot(covariance.ldlt().solve(difference)) > kMaxSigmas * kMaxSigmas;
}

}  // namespace

Localiser::Localiser(camera::Rig rig, const Config& config, map::BundledMap map, place::VocabularyPtr vocabulary,
                     std::vector<image::Image> masks)
    : run_rig_(std::move(rig)),
      config_(config_to_localise(config)),
      cameras_{map::find_or_append_rig(map, run_rig_), run_rig_.size()},
      map_(std::make_shared<const map::BundledMap>(std::move(map))),
      rig_(map::with_cameras(map_->given_rig(), cameras_.first, run_rig_)),
      masks_(widened(std::move(masks), cameras_, rig_.size())),
      places_(std::make_shared<SharedPlaces>(std::move(vocabulary), config_.looping.recognition)) {
  places_->query_frame(*map_, frame::BundledFrame());  // computes the index
}

// The record of a frame, of the cameras of the run.
tracking::FrameRecord Localiser::located(const image::ImageBundle& images) const {
  FixedMap map(map_);
  auto relocaliser = std::make_unique<PlaceRelocaliser>(std::make_unique<PlacesOfThread>(places_), config_);
  Pipeline pipeline(rig_, cameras_, config_, masks_, std::move(relocaliser), nullptr);
  Pipeline::Outcome outcome = pipeline.process(widened(images, cameras_, rig_.size()), map);
  narrow(outcome.record, cameras_);
  return std::move(outcome.record);
}

// A camera with far fewer inliers than another one may look elsewhere or be covered, but it may also have the image of
// another camera or time: then its image alone is found in the map, at another pose. Unless more cameras support the
// pose than agree on another one, it may be as wrong as it is certain.
bool Localiser::located_elsewhere(const image::ImageBundle& images, const tracking::TrackResult& result) const {
  constexpr int kFewer = 3;
  int most = 0;
  std::ptrdiff_t supporting = 0, contradicting = 0;
  for (const tracking::CameraCounts& camera : result.cameras) most = std::max(most, camera.inliers);
  std::vector<tracking::TrackResult> others;
  for (std::size_t c = 0; c < result.cameras.size(); ++c) {
    if (images.images[c].state != image::ImageState::kPresent) continue;
    if (kFewer * result.cameras[c].inliers > most) {
      ++supporting;
      continue;
    }
    const tracking::TrackResult alone = located(with_one_image(images, c)).result;
    if (alone.status == tracking::TrackStatus::kTracking && differ(*map_, alone, result)) others.push_back(alone);
  }
  for (const tracking::TrackResult& other : others) {
    contradicting = std::max(contradicting, std::ranges::count_if(others, [&](const tracking::TrackResult& another) {
                               return !differ(*map_, other, another);
                             }));
  }
  return !others.empty() && contradicting >= supporting;
}

Result<tracking::FrameRecord> Localiser::localise(const image::ImageBundle& images) const {
  if (const Status valid = check_frame(images, run_rig_, std::nullopt); !valid) return valid.error();
  tracking::FrameRecord record = located(images);
  tracking::TrackResult& result = record.result;
  if (result.status == tracking::TrackStatus::kTracking &&
      (std::ranges::any_of(result.cameras, tracking::contradicts_pose) || located_elsewhere(images, result))) {
    result.status = tracking::TrackStatus::kLost;
    result.reason = tracking::LostReason::kUnstablePose;
  }
  return record;
}

}  // namespace bslam::system
