// Do the cameras of a frame agree? A camera may deliver good pictures of the wrong thing: another camera's, those of a
// mount that was knocked, of a cover with texture. Then hardly anything is where the rest of the rig expects it, and it
// is left out until it sees what it should again.
#pragma once

#include <vector>

#include "tracking/frame_matches.h"

namespace bslam::tracking {

// What is carried from frame to frame about one camera.
struct CameraTrust {
  bool doubted = false;
  bool established = false;           // has once seen as much as it can be judged by
  int seeing = 0;                     // frames in a row in which a doubted camera saw what it should
  TimeNs judged_ns = 0;               // when a doubted camera last should have seen something
  TimeNs since_ns = 0;                // since when it is doubted, or was last found to show its view displaced
  double share = 1.0;                 // of what it should have seen again in the last frame that could tell, found
  TimeNs seen_ns = 0;                 // when it last delivered an image that counted ...
  std::vector<LandmarkId> landmarks;  // ... and the inliers of that
};

// Without doubts, and with nothing seen yet.
CameraTrust trusted(bool established);

// What of it counts where the rig starts or was found again after a loss, `seen[c]` landmarks of the place by camera c.
std::vector<CameraTrust> doubts_of(std::vector<CameraTrust> cameras, const std::vector<int>& seen,
                                   const ConsensusOptions& options);

// How much of what a camera should see it found.
struct Expectation {
  int expected = 0, found = 0;
  double share() const { return expected > 0 ? static_cast<double>(found) / expected : 0.0; }
};

// Of the landmarks each camera saw in the last frame, those in its view at `T_rig_world` now, and among `found`.
std::vector<Expectation> continuity(const map::BundledMap& map, const frame::BundledFrame& frame,
                                    const geometry::SE3& T_rig_world, const std::vector<CameraTrust>& trust,
                                    const FrameMatches& found);

// Flags the cameras that found much of what they looked for, but elsewhere than the pose puts it. A camera that is not
// established yet knows of the map only what others saw, which it may mistake: it is not flagged.
std::vector<std::uint8_t> contradicting(const FrameMatches& matches, const std::vector<int>& inliers_per_camera,
                                        const std::vector<CameraTrust>& trust, const ConsensusOptions& options);

// Where cameras contradict one another, that one is believed whose own pose is nearest to where the motion led to: the
// pose from its observations and what agrees with them. `observations` of `matches`, in their order.
solver::PoseSolution believe_the_steadiest(const camera::Rig& rig, const FrameMatches& matches,
                                           std::span<const solver::PoseObservation> observations,
                                           const geometry::SE3& predicted, const ConsensusOptions& options,
                                           const solver::PoseSolverOptions& pose);

// Flags the cameras that lost from one frame to the next what they saw, while another camera did not. Where it went
// little by little something passes by: a doorpost, the end of a wall. At least one camera is not flagged.
std::vector<std::uint8_t> disagreeing(const std::vector<Expectation>& continuity, const std::vector<CameraTrust>& trust,
                                      const ConsensusOptions& options);

// Notes what a camera that counts found again.
void trust(CameraTrust& camera, const Expectation& continuity, const ConsensusOptions& options);

// Begins or goes on to doubt a camera. `view`: what of the map should be seen by it in the frame of `time_ns`, and is.
void doubt(CameraTrust& camera, const Expectation& view, TimeNs time_ns, const ConsensusOptions& options);

// Is a doubted camera to be tried again, unless its view is found displaced?
bool due_for_retry(const CameraTrust& camera, TimeNs time_ns, const ConsensusOptions& options);

// What became of that. `wide`: what of the map should be seen by it, and is anywhere near.
void retry(CameraTrust& camera, const Expectation& wide, TimeNs time_ns, const ConsensusOptions& options);

// Takes a camera out of a frame as if it had delivered no image.
void leave_out(const camera::Rig& rig, std::size_t camera, double min_parallax, double max_chi2,
               frame::BundledFrame& frame);

}  // namespace bslam::tracking
