// Consistency between the cameras of a frame. A camera may deliver good images of the wrong scene: of another camera,
// from a displaced mount, or of a textured cover. Few landmarks are then found where the pose of the rig predicts them,
// and the camera is excluded until its images are consistent with the map again.
#pragma once

#include <vector>

#include "tracking/frame_matches.h"

namespace bslam::tracking {

// State of one camera that is carried from frame to frame.
struct CameraConsensusState {
  bool excluded = false;      // its images are not used
  bool established = false;   // has found `min_expected` landmarks in some frame; required to exclude it for conflicts
  int consistent_frames = 0;  // consecutive frames in which an excluded camera was consistent with the map
  TimeNs last_judged_ns = 0;  // time at which an excluded camera last had enough landmarks in view to be checked
  TimeNs excluded_since_ns = 0;  // time of the exclusion, or time at which its view was last found to be displaced
  // Ratio in the last frame with enough expected landmarks; in direct tracking, of the aligned landmarks.
  double reobservation_ratio = 1.0;
  TimeNs last_image_ns = 0;           // time of its last image that was used
  std::vector<LandmarkId> landmarks;  // inliers of that image
};

// State of a camera that is not excluded and has not observed any landmarks yet.
CameraConsensusState readmitted(bool established);

// States after a map is initialised or the rig is relocalised. Camera c is readmitted if it observes enough landmarks
// of the place (`seen[c]`); the other cameras keep their state. The landmarks of all cameras are cleared.
std::vector<CameraConsensusState> readmit_observing_cameras(std::vector<CameraConsensusState> cameras,
                                                            const std::vector<int>& seen,
                                                            const ConsensusOptions& options);

// Number of landmarks predicted in the image of a camera, and how many of them it matched.
struct LandmarkCounts {
  int expected = 0, found = 0;
  double ratio() const { return expected > 0 ? static_cast<double>(found) / expected : 0.0; }
};

// Per camera: the landmarks of its last image that project into this image at `T_rig_world`, and how many of them are
// in `found`. Zero for cameras that are excluded or have no image.
std::vector<LandmarkCounts> count_reobserved(const map::BundledMap& map, const frame::BundledFrame& frame,
                                             const geometry::SE3& T_rig_world,
                                             const std::vector<CameraConsensusState>& states,
                                             const FrameMatches& found);

// Per excluded camera: those of the landmarks that it has observed itself and that are predicted in its image, and how
// many of them are found in it. Zero for the other cameras, and for those without keypoints.
std::vector<LandmarkCounts> count_own(const map::BundledMap& map, const frame::BundledFrame& frame,
                                      const geometry::SE3& T_rig_world, std::span<const std::uint8_t> excluded,
                                      std::span<const LandmarkId> landmarks,
                                      const matching::ProjectionSearchOptions& windows);

// Per camera: the number of matches that are used to judge whether the camera agrees with a pose, and how many of them
// are inliers. `inlier`: one flag per match, in order. A landmark that is also an outlier in a camera without conflict
// has probably moved; it is not counted in cameras with few inliers.
std::vector<LandmarkCounts> count_agreeing(const FrameMatches& matches, std::span<const std::uint8_t> inlier,
                                           const ConsensusOptions& options);

// Flags the cameras that have many matches of which few agree with the pose. A camera that is not established is not
// flagged: the landmarks in its view were observed by other cameras only, so that its matches may be wrong.
std::vector<std::uint8_t> conflicting_cameras(const std::vector<LandmarkCounts>& agreeing,
                                              const std::vector<CameraConsensusState>& states,
                                              const ConsensusOptions& options);
// Flags the conflicting cameras whose inlier ratio is clearly lower than that of the best camera. In a blurred or badly
// predicted frame the ratio is low in all cameras, which is no reason to exclude one.
std::vector<std::uint8_t> contradicting_cameras(const std::vector<LandmarkCounts>& agreeing,
                                                const std::vector<CameraConsensusState>& states,
                                                const ConsensusOptions& options);

// The pose if cameras contradict each other. A pose is estimated from each camera with enough matches, and used if it
// has enough inliers (`healthy_reobservation_ratio`), as is `of_all`, the pose from all cameras, if it has enough in
// one of them. The one nearest to the prediction of the motion model is refined with all observations that agree with
// it. Returns a solution that is not ok if there is none, or if the cameras do not contradict each other: one of these
// poses agrees with all of them about equally, so that several things move and all cameras see the same.
// `observations`: those of `matches`, in the same order.
solver::PoseSolution pose_of_most_consistent_camera(const camera::Rig& rig, const FrameMatches& matches,
                                                    std::span<const solver::PoseObservation> observations,
                                                    const solver::PoseSolution& of_all, const geometry::SE3& predicted,
                                                    const ConsensusOptions& options,
                                                    const solver::PoseSolverOptions& pose);

// Flags the cameras that lost most of their landmarks from one frame to the next while another camera re-observed its
// landmarks. A camera that loses them over several frames is not flagged: a near object may be moving through its view.
// At least one camera is not flagged, nor is one in whose image direct tracking has just aligned the patches of its
// landmarks: some of them, which other cameras see in more detail, are found by alignment but not by descriptors.
// `aligned`: per camera, the landmarks that direct tracking searched for in this frame, and the inliers among them;
// empty if it was not tried, or found no pose or a doubtful one.
std::vector<std::uint8_t> cameras_losing_view(const std::vector<LandmarkCounts>& reobserved,
                                              std::span<const LandmarkCounts> aligned,
                                              const std::vector<CameraConsensusState>& states,
                                              const ConsensusOptions& options);

// Updates the re-observation ratio of a camera that is used.
void update_reobservation_ratio(CameraConsensusState& camera, const LandmarkCounts& reobserved,
                                const ConsensusOptions& options);

// Excludes a camera, or readmits an excluded one if it is consistent with the map again or could not be checked for
// `forget_after_s`. `view`: landmarks of the map in its view in the frame of `time_ns`. `ratio_of_used`: the largest
// ratio of a camera in use. Where even such a camera finds few of the many landmarks of the map, fewer suffice.
void update_exclusion(CameraConsensusState& camera, const LandmarkCounts& view, double ratio_of_used, TimeNs time_ns,
                      const ConsensusOptions& options);

// Returns true if a camera has been excluded for so long that it is to be readmitted, unless its view is displaced.
bool due_for_retry(const CameraConsensusState& camera, TimeNs time_ns, const ConsensusOptions& options);

// Readmits such a camera unless its view is displaced. `view`, `wide`: landmarks of the map in its view, searched for
// in narrow and in wide windows; the view is displaced if many of them are found in the wide ones only.
void retry(CameraConsensusState& camera, const LandmarkCounts& view, const LandmarkCounts& wide, TimeNs time_ns,
           const ConsensusOptions& options);

// Removes a camera's keypoints from a frame as if it had delivered no image.
void remove_camera(const camera::Rig& rig, std::size_t camera, double min_parallax, double max_chi2,
                   frame::BundledFrame& frame);

}  // namespace bslam::tracking
