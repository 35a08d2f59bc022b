// Localisation of single frames in a map that is not changed. Each frame is relocalised like the first frame of a run
// in a loaded map, independently of all other frames.
#pragma once

#include <memory>
#include <mutex>
#include <vector>

#include "base/result.h"
#include "camera/rig.h"
#include "image/image_bundle.h"
#include "looping/place_recogniser.h"
#include "system/config.h"
#include "tracking/frame_record.h"

namespace bslam::system {

// Holds one copy of the map and of the index of places, which all threads share. All functions are thread-safe.
class Localiser {
 public:
  // `map` must have at least one keyframe; if it does not have the cameras of `rig`, they are appended. Masks: one per
  // camera of the rig, empty if it has none; or no masks at all. Settings that do not affect the localisation of a
  // frame are ignored. The constructor builds the index of places, which takes about a millisecond per keyframe.
  Localiser(camera::Rig rig, const Config& config, map::BundledMap map, place::VocabularyPtr vocabulary,
            std::vector<image::Image> masks = {});

  // The pose of a frame, which depends on its images and their times only. `images`: one entry per camera of the rig;
  // images may be missing. A frame that is not found in the map is lost, with the reason, as is one of which an image
  // contradicts the pose, or as many images as support it are found at another pose if they are located alone. Errors:
  // see check_frame in system/input_check.h.
  Result<tracking::FrameRecord> localise(const image::ImageBundle& images) const;

  const camera::Rig& rig() const { return run_rig_; }
  const map::BundledMap& map() const { return *map_; }

 private:
  tracking::FrameRecord located(const image::ImageBundle& images) const;
  bool located_elsewhere(const image::ImageBundle& images, const tracking::TrackResult& result) const;

  const camera::Rig run_rig_;  // rig of the run, as given
  const Config config_;
  const CamerasOfRun cameras_;  // in rig_
  const map::MapSnapshot map_;
  const camera::Rig rig_;                  // rig of the map, with the given calibration
  const std::vector<image::Image> masks_;  // per camera of the map
  const std::shared_ptr<looping::PlaceRecogniser> places_;
};

}  // namespace bslam::system
