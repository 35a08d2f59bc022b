// A proposed change of the map, as a value, that a stage passes to MapStore::commit.
//
// Rebase rules, for the case that other edits were committed between the edit's base version and its own commit.
// "Newer" means created by those other edits.
//
// clang-format off
// | operation           | rule                                                                                     |
// | AddKeyframe         | gets the next id; matches to removed landmarks are dropped, those to merged ones         |
// |                     | forwarded; if its parent has moved since the base, the keyframe moves with it; if the    |
// |                     | submap of its parent was removed, the keyframe becomes the root of a new submap          |
// | AddLandmark         | gets the next id; observations by removed keyframes or of features that already have a   |
// |                     | landmark are dropped, and the landmark itself if none are left; if the keyframe of its   |
// |                     | reference has moved since the base, the landmark moves with it                           |
// | AddObservation      | forwarded along merges; dropped if the landmark or keyframe was removed, the feature     |
// |                     | already has a landmark, or the keyframe already observes the landmark                    |
// | RemoveObservation   | dropped if the observation no longer exists, also because of a merge                     |
// | RemoveLandmark      | dropped if it was already removed or merged, or if a newer keyframe observes it          |
// | MergeLandmarks      | both ends are forwarded; dropped if they are already the same or one was removed         |
// | RemoveKeyframe      | dropped if it was already removed or is a root                                           |
// | SetPoses            | dropped if a correction was committed since the base (the next adjustment starts from    |
// |                     | it); entries of removed keyframes and of removed or merged landmarks are dropped; newer  |
// |                     | keyframes move with their parent (chains of them with the nearest ancestor that is not   |
// |                     | newer), newer landmarks with the keyframe of their reference; newer keyframes keep their |
// |                     | uncertainties                                                                            |
// | SetTwists           | entries of removed keyframes are dropped; translational velocities are multiplied by the |
// |                     | change of scale at the keyframe since the base                                           |
// | CorrectTimes        | dropped if a correction was committed since the base; entries of removed keyframes are   |
// |                     | dropped; the last one committed wins                                                     |
// | ScaleSubmap         | also scales newer keyframes and landmarks; dropped if the submap was removed or merged   |
// | MergeSubmaps        | a removed keyframe is replaced by its nearest alive ancestor; dropped if both are in the |
// |                     | same submap                                                                              |
// | RemoveSubmap        | dropped if the submap was already removed or merged                                      |
// | AddVisibilityCounts | forwarded along merges; entries of removed landmarks are dropped                         |
// | RefreshLandmarks    | forwarded along merges; entries of removed landmarks are dropped                         |
// | SetScale            | the last one committed wins; kMetric is dropped if a newer keyframe is the root of a     |
// |                     | submap, whose scale the edit does not know                                               |
// | SetRig              | the last one committed wins; newer keyframes get the bearings of the rig                 |
// clang-format on
//
// An edit that corrects the map (SetPoses::correction, ScaleSubmap) is rejected as a whole if another correction was
// committed since its base: applying only part of it, for example merged landmarks and joined submaps without the
// corrected poses, would break the map. With these rules the final pose of a new keyframe does not depend on whether it
// is committed before or after a correction of its surroundings. An operation with several entries counts as dropped if
// all entries are dropped. An operation on something the edit itself added is dropped if that addition was.
#pragma once

#include <memory>
#include <utility>
#include <variant>
#include <vector>

#include "map/bundled_map.h"

namespace bslam::map {

// Ids of things that an edit adds are provisional: the ids that the base version would assign next.
struct AddKeyframe {
  KeyframeId provisional;
  std::shared_ptr<const frame::BundledFrame> frame;
  geometry::SE3 T_rig_world;
  std::vector<std::pair<FeatureId, LandmarkId>> matches;
  KeyframeId parent;  // parent in the draft; invalid for the root of a submap
};
struct AddLandmark {
  LandmarkId provisional;
  Eigen::Vector3d position;
  std::vector<Observation> observations;
  LandmarkReference reference;
};
struct AddObservation {
  LandmarkId landmark;
  Observation observation;
};
struct RemoveObservation {
  LandmarkId landmark;
  KeyframeId keyframe;
};
struct RemoveLandmark {
  LandmarkId landmark;
};
struct MergeLandmarks {
  LandmarkId from, into;
};
struct RemoveKeyframe {
  KeyframeId keyframe;
};
struct MergeSubmaps {
  KeyframeId child, parent;
};
struct RemoveSubmap {
  KeyframeId root;
};
struct ScaleSubmap {
  KeyframeId root;
  double factor = 1.0;
};
struct SetPoses {
  std::vector<std::pair<KeyframeId, geometry::SE3>> keyframes;  // T_rig_world
  std::vector<std::pair<LandmarkId, Eigen::Vector3d>> landmarks;
  bool correction = false;  // a correction of the whole map: begins a gauge epoch
  // Factors by which lengths about a keyframe change (BundledMap::scale_keyframes); keyframes without one keep theirs.
  std::vector<std::pair<KeyframeId, double>> scale_changes = {};
  // BundledKeyframe::uncertainty of some keyframes, also of some that are not in `keyframes`; the others keep theirs.
  // Lengths are those before `scale_changes`, which rescales them.
  std::vector<std::pair<KeyframeId, geometry::PoseUncertainty>> uncertainties = {};
};
struct SetTwists {
  std::vector<std::pair<KeyframeId, geometry::Vector6d>> keyframes;  // BundledKeyframe::twist
};
struct CorrectTimes {
  std::vector<CaptureTime> changes;
};
struct VisibilityCount {
  LandmarkId landmark;
  std::uint32_t expected = 0, found = 0;
};
struct AddVisibilityCounts {
  std::vector<VisibilityCount> visibility_counts;
};
struct RefreshLandmarks {
  std::vector<LandmarkId> landmarks;
};
struct SetScale {
  Scale scale = Scale::kMetric;
  double deviation = 0;
};

struct SetRig {
  std::shared_ptr<const camera::Rig> rig;
  std::shared_ptr<const Eigen::MatrixXd> deviation;  // BundledMap::rig_deviation
  // New frames for keyframes of the base, with bearings computed with the new calibration.
  std::vector<BundledMap::ReplacedFrame> frames;
};

using Operation = std::variant<AddKeyframe, AddLandmark, AddObservation, RemoveObservation, RemoveLandmark,
                               MergeLandmarks, RemoveKeyframe, MergeSubmaps, RemoveSubmap, ScaleSubmap, SetPoses,
                               SetTwists, CorrectTimes, AddVisibilityCounts, RefreshLandmarks, SetScale, SetRig>;

struct MapEdit {
  MapSnapshot base;
  std::vector<Operation> operations;
};

// A snapshot with private changes: a stage writes to it, reads its own changes back, and finally extracts the edit. One
// draft per run of a stage; not thread-safe. Functions that return bool behave like those of BundledMap; an operation
// that changes nothing is not recorded.
class MapDraft {
 public:
  explicit MapDraft(MapSnapshot base);

  const BundledMap& map() const { return working_; }  // the base version with all changes so far
  bool corrects() const { return working_.gauge_epoch() != edit_.base->gauge_epoch(); }
  // Returns true if the draft contains a correction and another correction has been committed since its base; `newest`
  // is the newest version. Committing such a draft is rejected.
  bool superseded(const BundledMap& newest) const {
    return corrects() && edit_.base->gauge_epoch() != newest.gauge_epoch();
  }

  // The matches may refer to an older version of the map: those to merged landmarks are forwarded; those to removed
  // landmarks, and repeated features or landmarks after the first, are dropped.
  KeyframeId add_keyframe(std::shared_ptr<const frame::BundledFrame> frame, const geometry::SE3& T_rig_world,
                          std::vector<std::pair<FeatureId, LandmarkId>> matches, KeyframeId fallback_parent);
  LandmarkId add_landmark(const Eigen::Vector3d& position, std::vector<Observation> observations,
                          const LandmarkReference& reference = {});
  bool add_observation(LandmarkId l, Observation o);
  bool remove_observation(LandmarkId l, KeyframeId k);
  bool remove_landmark(LandmarkId l);
  bool merge_landmarks(LandmarkId from, LandmarkId into);
  bool remove_keyframe(KeyframeId k);
  bool merge_submaps(KeyframeId child, KeyframeId parent);
  bool remove_submap(KeyframeId root);
  bool scale_submap(KeyframeId root, double factor);
  // Entries of removed keyframes and landmarks are ignored.
  void set_poses(SetPoses poses);
  void correct_times(std::vector<CaptureTime> changes);
  void set_twists(std::vector<std::pair<KeyframeId, geometry::Vector6d>> twists);
  void add_visibility_counts(std::vector<VisibilityCount> visibility_counts);
  void refresh_landmarks(std::vector<LandmarkId> landmarks);
  void set_scale(Scale scale);  // with deviation 0 for kMetric, infinite otherwise
  void set_scale(Scale scale, double deviation);
  // The same cameras with another calibration. `deviation` as in BundledMap::rig_deviation.
  void set_rig(camera::Rig rig, std::shared_ptr<const Eigen::MatrixXd> deviation = {});

  // The edit, and the working copy. MapStore publishes the copy unchanged if the base is still the newest version.
  struct Finished {
    MapEdit edit;
    BundledMap result;
  };
  Finished finish() &&;

 private:
  MapEdit edit_;
  BundledMap working_;
};

}  // namespace bslam::map
