#include "mapping/cull.h"

#include <algorithm>

namespace bslam::mapping {
namespace {

int num_keypoints(const map::BundledMap& map, LandmarkId l) {
  int n = 0;
  for (const map::Observation& o : map.observations(l)) {
    n += static_cast<int>(map.keyframe(o.keyframe).frame->bundled.keypoints(o.feature).size());
  }
  return n;
}

// Finest pyramid level of the keypoints of an observation.
int finest_level(const map::BundledMap& map, const map::Observation& o) {
  const frame::BundledFrame& frame = *map.keyframe(o.keyframe).frame;
  int finest = 255;
  for (const frame::KeypointRef r : frame.bundled.keypoints(o.feature)) {
    finest = std::min<int>(finest, frame.keypoints(r.camera).level[r.keypoint.index()]);
  }
  return finest;
}

// Returns true if at least `count` keyframes other than k observe the landmark on a pyramid level that is at most one
// coarser than in k.
bool observed_elsewhere(const map::BundledMap& map, LandmarkId landmark, KeyframeId k, int count) {
  const auto observations = map.observations(landmark);
  if (static_cast<int>(observations.size()) <= count) return false;
  const auto own = std::ranges::find(observations, k, &map::Observation::keyframe);
  const int level = finest_level(map, *own);
  for (const map::Observation& o : observations) {
    if (count <= 0) break;
    count -= o.keyframe != k && finest_level(map, o) <= level + 1;
  }
  return count <= 0;
}

bool redundant(const map::BundledMap& map, KeyframeId k, const CullingOptions& options) {
  const auto& landmarks = map.keyframe(k).landmarks;
  const auto all = std::ranges::count_if(landmarks, &LandmarkId::valid);
  const double needed = options.redundant_ratio * static_cast<double>(all);
  std::ptrdiff_t possible = all;  // landmarks that are observed elsewhere or not yet examined
  for (const LandmarkId l : landmarks) {
    if (!(static_cast<double>(possible) > needed)) return false;
    possible -= l.valid() && !observed_elsewhere(map, l, k, options.redundant_views);
  }
  return static_cast<double>(possible) > needed;
}

// Counts keyframes back from the newest one, per camera.
class KeyframesSince {
 public:
  KeyframesSince(const map::BundledMap& map, KeyframeId newest) : map_(map), next_(newest), counts_(map.rig().size()) {}

  // The number of keyframes after `born` that have keypoints of the camera, or have been removed. `born` must not be
  // later than in the call before.
  int with_images_of(CameraIndex camera, KeyframeId born) {
    for (; next_ > born; next_ = KeyframeId(next_.value() - 1)) {
      for (std::size_t c = 0; c < counts_.size(); ++c)
        counts_[c] += !map_.alive(next_) || !map_.keyframe(next_).frame->cameras[c].keypoints.empty();
    }
    return counts_[camera.index()];
  }

 private:
  const map::BundledMap& map_;
  KeyframeId next_;  // the newest one that has not been counted
  std::vector<int> counts_;
};

}  // namespace

void cull_landmarks(KeyframeId newest, const CullingOptions& options, map::MapDraft& draft) {
  constexpr int kLongest = 4;  // times the probation, for landmarks of cameras that few keyframes have images of
  const map::BundledMap& map = draft.map();
  // Landmark ids are in order of creation, so the recent landmarks are at the end.
  std::vector<LandmarkId> bad;
  KeyframesSince since(map, newest);
  for (std::size_t i = map.landmark_slots(); i-- > 0;) {
    const LandmarkId id(i);
    const map::Landmark& l = map.landmark(id);
    if (!l.alive) continue;
    const int age = newest.value() - l.born.value();
    if (age > kLongest * options.probation) break;
    const int seen = since.with_images_of(l.reference.keypoint.camera, l.born);
    const bool last = age == kLongest * options.probation;
    // A keyframe that is removed may raise the number by more than one, past the end of the probation.
    if (seen > options.probation && !(last && seen < age)) continue;
    const bool rarely_matched = l.expected > 3 && l.found < options.min_found_ratio * l.expected;
    const bool ends = seen == options.probation || last;
    const bool few_keypoints = ends && num_keypoints(map, id) < options.min_keypoints;
    if (rarely_matched || few_keypoints) bad.push_back(id);
  }
  for (const LandmarkId l : bad) draft.remove_landmark(l);
}

void cull_keyframes(KeyframeId newest, const CullingOptions& options, map::MapDraft& draft) {
  const std::vector<map::Covisible> neighbours = draft.map().keyframe(newest).covisible;
  for (const map::Covisible& c : neighbours) {
    const bool root = !draft.map().keyframe(c.keyframe).parent.valid();
    if (root || c.keyframe.value() >= newest.value() - 2 || !draft.map().alive(c.keyframe)) continue;
    if (redundant(draft.map(), c.keyframe, options)) draft.remove_keyframe(c.keyframe);
  }
}

}  // namespace bslam::mapping
