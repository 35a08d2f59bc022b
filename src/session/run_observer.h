// Follows a run while it goes on.
#pragma once

#include <vector>

#include "image/image_bundle.h"
#include "map/map_store.h"
#include "system/system.h"
#include "tracking/frame_record.h"
#include "tracking/observed_keypoints.h"

namespace bslam::session {

// The result of a processed frame.
struct ProcessedFrame {
  image::ImageBundle images;
  tracking::FrameRecord record;
  std::vector<tracking::ObservedKeypoints> keypoints;  // per camera
  map::MapSnapshot map;                                // the newest version
  std::size_t first_camera = 0;                        // index of the run's first camera in the rig of the map
  double read_ms = 0;
};

class RunObserver {
 public:
  virtual ~RunObserver() = default;

  // These are called by the thread that feeds the frames, and must return at once.
  virtual void processed(ProcessedFrame&& frame, const system::System& system) = 0;
  virtual void dropped(TimeNs time_ns, double read_ms) = 0;  // a frame that was not processed
  virtual void fed() = 0;                                    // after the last frame, before the work at the end
};

}  // namespace bslam::session
