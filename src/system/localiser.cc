#include "system/localiser.h"

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

Result<tracking::FrameRecord> Localiser::localise(const image::ImageBundle& images) const {
  if (const Status valid = check_frame(images, run_rig_, std::nullopt); !valid) return valid.error();
  FixedMap map(map_);
  auto relocaliser = std::make_unique<PlaceRelocaliser>(std::make_unique<PlacesOfThread>(places_), config_);
  Pipeline pipeline(rig_, cameras_, config_, masks_, std::move(relocaliser), nullptr);
  Pipeline::Outcome outcome = pipeline.process(widened(images, cameras_, rig_.size()), map);
  narrow(outcome.record, cameras_);
  tracking::TrackResult& result = outcome.record.result;
  if (result.status == tracking::TrackStatus::kTracking &&
      std::ranges::any_of(result.cameras, tracking::contradicts_pose)) {
    result.status = tracking::TrackStatus::kLost;
    result.reason = tracking::LostReason::kUnstablePose;
  }
  return std::move(outcome.record);
}

}  // namespace bslam::system
