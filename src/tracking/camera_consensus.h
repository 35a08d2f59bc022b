// Do the cameras of a frame agree? A camera may deliver good pictures of the wrong thing: of another camera, from a
// mount that was knocked, of a cover with texture. Then hardly any landmark is where the pose of the rig puts it, and
// the camera is left out until it sees again what it should.
#pragma once

#include <vector>

#include "tracking/frame_matches.h"

namespace bslam::tracking {

// What is carried from frame to frame about one camera.
struct CameraTrust {
  bool doubted = false;               // left out of the frames
  bool established = false;           // once found enough landmarks in a frame to be judged by
  int seeing = 0;                     // frames in a row in which a doubted camera saw what it should
  TimeNs judged_ns = 0;               // when a doubted camera last had enough landmarks in view to be judged by
  TimeNs since_ns = 0;                // since when it is doubted, or when its view was last found to be displaced
  double share = 1.0;                 // re-observation ratio in the last frame that could be judged
  TimeNs seen_ns = 0;                 // time of its last image that was used
  std::vector<LandmarkId> landmarks;  // inliers of that image
};

// A camera that is not doubted, with no landmarks seen yet.
CameraTrust trusted(bool established);

// The trust that remains where a map is started or the rig is located after a loss. `seen[c]`: landmarks of the place
// seen by camera c; with enough of them it is trusted.
std::vector<CameraTrust> doubts_of(std::vector<CameraTrust> cameras, const std::vector<int>& seen,
                                   const ConsensusOptions& options);

// Landmarks a camera should find, and how many of them it found.
struct Expectation {
  int expected = 0, found = 0;
  double share() const { return expected > 0 ? static_cast<double>(found) / expected : 0.0; }
};

// Per camera: the landmarks it saw in the last frame that project into its image at `T_rig_world`, and how many of them
// are among `found`.
std::vector<Expectation> continuity(const map::BundledMap& map, const frame::BundledFrame& frame,
                                    const geometry::SE3& T_rig_world, const std::vector<CameraTrust>& trust,
                                    const FrameMatches& found);

// Flags the cameras that have many matches of which few agree with the pose. A camera that is not established is not
// flagged: it knows of the map only what others saw, and may mistake it.
std::vector<std::uint8_t> contradicting(const FrameMatches& matches, const std::vector<int>& inliers_per_camera,
                                        const std::vector<CameraTrust>& trust, const ConsensusOptions& options);

// The pose where cameras contradict one another: of the poses estimated from one camera each, the one nearest to the
// prediction of the motion model is refined with all observations that agree with it. `observations`: those of
// `matches`, in their order.
solver::PoseSolution pose_of_most_consistent_camera(const camera::Rig& rig, const FrameMatches& matches,
                                                    std::span<const solver::PoseObservation> observations,
                                                    const geometry::SE3& predicted, const ConsensusOptions& options,
                                                    const solver::PoseSolverOptions& pose);

// Flags the cameras that lost what they saw from one frame to the next, while another camera did not. One that loses it
// over several frames is not flagged: something near passes by. At least one camera is not flagged.
std::vector<std::uint8_t> disagreeing(const std::vector<Expectation>& continuity, const std::vector<CameraTrust>& trust,
                                      const ConsensusOptions& options);

// Updates the re-observation ratio of a camera that is used.
void trust(CameraTrust& camera, const Expectation& continuity, const ConsensusOptions& options);

// Marks a camera as doubted, or decides whether one that is may be used again. `view`: landmarks of the map in its view
// in the frame of `time_ns`.
void doubt(CameraTrust& camera, const Expectation& view, TimeNs time_ns, const ConsensusOptions& options);

// Has a camera been doubted for so long that it is used again, unless its view is found to be displaced?
bool due_for_retry(const CameraTrust& camera, TimeNs time_ns, const ConsensusOptions& options);

// Decides that. `wide`: landmarks of the map in its view, searched for in wide windows; finding many of them there
// means that the view is displaced.
void retry(CameraTrust& camera, const Expectation& wide, TimeNs time_ns, const ConsensusOptions& options);

// Removes a camera's keypoints from a frame as if it had delivered no image.
void leave_out(const camera::Rig& rig, std::size_t camera, double min_parallax, double max_chi2,
               frame::BundledFrame& frame);

}  // namespace bslam::tracking
