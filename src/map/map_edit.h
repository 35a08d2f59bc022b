// A proposed change of the map, as a value: what a stage hands to MapStore::commit.
//
// Rebase rules, where other edits were committed between the edit's base and its commit (`newer` = made by those others):
// | operation         | rule                                                                                         |
// | AddKeyframe       | gets the next id; matches to removed landmarks are dropped, to merged ones are forwarded;    |
// |                   | where its parent was moved since the base, it moves along; where the part of its parent was  |
// |                   | removed, it begins one                                                                       |
// | AddLandmark       | gets the next id; observations in removed keyframes or taken features are dropped; with none |
// |                   | left the landmark is dropped; where the keyframe of its reference was moved since the base,  |
// |                   | it moves along                                                                               |
// | AddObservation    | forwarded along merges; dropped where landmark or keyframe is gone, the feature is taken or  |
// |                   | the keyframe observes the landmark already                                                   |
// | RemoveObservation | dropped where it is gone already, also by a merge                                            |
// | RemoveLandmark    | dropped where it is gone already, also by a merge; and where a newer keyframe observes it    |
// | MergeLandmarks    | both ends forwarded; dropped where they are one already or one is gone                       |
// | RemoveKeyframe    | dropped where it is gone already or is the root                                              |
// | SetPoses          | dropped where a correction was committed since the base: the next adjustment starts from it;  |
// |                   | entries of removed keyframes and of removed or merged landmarks are dropped; newer keyframes |
// |                   | move with their parent (chains with the nearest older ancestor), newer landmarks with the    |
// |                   | keyframe of their reference                                                                  |
// | SetTwists         | entries of removed keyframes are dropped; they grow as lengths about the keyframe have since |
// |                   | the base                                                                                     |
// | ScalePart         | scales what is newer along; dropped where the part is gone or has become part of another     |
// | JoinParts         | a removed keyframe stands for its nearest ancestor; dropped where they are of one part       |
// | RemovePart        | dropped where it is gone already or has become part of another                               |
// | AddSightings      | forwarded along merges, entries dropped where gone                                           |
// | RefreshLandmarks  | forwarded along merges, entries dropped where gone                                           |
// | SetScale, SetRig  | the later one holds                                                                          |
// An edit that corrects the map (SetPoses::correction, ScalePart) is refused as a whole where another correction was committed since
// its base: half of it, landmarks merged and parts hung together that were not moved, would tear the map.
// So the order in which a new keyframe and a correction of its surroundings are committed does not change where it ends
// up. An operation of several entries counts as dropped where all of them are. An operation on something the edit itself
// added is dropped where that was.
#pragma once

#include <memory>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "map/bundled_map.h"

namespace bslam::map {

// Ids of things an edit adds are provisional: those the base version would give next.
struct AddKeyframe {
  KeyframeId provisional;
  std::shared_ptr<const frame::BundledFrame> frame;
  geometry::SE3 T_rig_world;
  std::vector<std::pair<FeatureId, LandmarkId>> matches;
  KeyframeId parent;  // in the draft; invalid for the root of a part
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
struct JoinParts {
  KeyframeId child, parent;
};
struct RemovePart {
  KeyframeId root;
};
struct ScalePart {
  KeyframeId root;
  double factor = 1.0;
};
struct SetPoses {
  std::vector<std::pair<KeyframeId, geometry::SE3>> keyframes;        // T_rig_world
  std::vector<std::pair<LandmarkId, Eigen::Vector3d>> landmarks;
  bool correction = false;  // moves the map as a whole: begins a gauge epoch
};
struct SetTwists {
  std::vector<std::pair<KeyframeId, geometry::Vector6d>> keyframes;  // BundledKeyframe::twist
};
struct Sighting {
  LandmarkId landmark;
  std::uint32_t expected = 0, found = 0;
};
struct AddSightings {
  std::vector<Sighting> sightings;
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
};

using Operation = std::variant<AddKeyframe, AddLandmark, AddObservation, RemoveObservation, RemoveLandmark, MergeLandmarks,
                               RemoveKeyframe, JoinParts, RemovePart, ScalePart, SetPoses, SetTwists, AddSightings, RefreshLandmarks,
                               SetScale, SetRig>;

struct MapEdit {
  std::string_view stage;  // a literal
  MapSnapshot base;
  std::vector<Operation> operations;
};

// A snapshot with a private overlay: a stage writes to it, reads back what it wrote, and hands out the edit. One per run
// of a stage; not shared between threads. Functions that return bool do as those of BundledMap; what changes nothing is
// not recorded.
class MapDraft {
 public:
  MapDraft(std::string_view stage, MapSnapshot base);

  const BundledMap& map() const { return working_; }  // the base with all that was written so far
  bool corrects() const { return working_.gauge_epoch() != edit_.base->gauge_epoch(); }
  // A correction that newer ones have overtaken, `newest` being the newest version: committing it is refused.
  bool overtaken(const BundledMap& newest) const { return corrects() && edit_.base->gauge_epoch() != newest.gauge_epoch(); }

  // Matches may stem from an older version: those to merged landmarks are forwarded; those to removed ones, and later ones
  // of a feature or landmark that occurs twice, are dropped.
  KeyframeId add_keyframe(std::shared_ptr<const frame::BundledFrame> frame, const geometry::SE3& T_rig_world,
                          std::vector<std::pair<FeatureId, LandmarkId>> matches, KeyframeId fallback_parent);
  LandmarkId add_landmark(const Eigen::Vector3d& position, std::vector<Observation> observations,
                          const LandmarkReference& reference = {});
  bool add_observation(LandmarkId l, Observation o);
  bool remove_observation(LandmarkId l, KeyframeId k);
  bool remove_landmark(LandmarkId l);
  bool merge_landmarks(LandmarkId from, LandmarkId into);
  bool remove_keyframe(KeyframeId k);
  bool join_parts(KeyframeId child, KeyframeId parent);
  bool remove_part(KeyframeId root);
  bool scale_part(KeyframeId root, double factor);
  // Entries of what is not alive are left out.
  void set_poses(SetPoses poses);
  void set_twists(std::vector<std::pair<KeyframeId, geometry::Vector6d>> twists);
  void add_sightings(std::vector<Sighting> sightings);
  void refresh_landmarks(std::vector<LandmarkId> landmarks);
  void set_scale(Scale scale);  // nothing more being known of it than its name says
  void set_scale(Scale scale, double deviation);
  void set_rig(camera::Rig rig);  // the same cameras with other extrinsics

  // The edit and the working copy, which MapStore publishes as it is where the base is still the newest version.
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
