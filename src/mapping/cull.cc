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

bool redundant(const map::BundledMap& map, KeyframeId k, const CullingOptions& options) {
  int landmarks = 0, observed_elsewhere = 0;
  for (const LandmarkId l : map.keyframe(k).landmarks) {
    if (!l.valid()) continue;
    ++landmarks;
    const auto observations = map.observations(l);
    if (static_cast<int>(observations.size()) <= options.redundant_views) continue;
    const auto own = std::find_if(observations.begin(), observations.end(),
                                  [&](const map::Observation& o) { return o.keyframe == k; });
    const int level = finest_level(map, *own);
    const auto others = std::count_if(observations.begin(), observations.end(), [&](const map::Observation& o) {
      return o.keyframe != k && finest_level(map, o) <= level + 1;
    });
    observed_elsewhere += others >= options.redundant_views;
  }
  return landmarks > 0 && observed_elsewhere > options.redundant_ratio * landmarks;
}

}  // namespace

int cull_landmarks(KeyframeId newest, const CullingOptions& options, map::MapDraft& draft) {
  const map::BundledMap& map = draft.map();
  // Landmark ids are in order of creation, so the recent landmarks are at the end.
  std::vector<LandmarkId> bad;
  for (std::size_t i = map.landmark_slots(); i-- > 0;) {
    const LandmarkId id(i);
    const map::Landmark& l = map.landmark(id);
    if (!l.alive) continue;
    const int age = newest.value() - l.born.value();
    if (age > options.probation) break;
    const bool rarely_matched = l.expected > 3 && l.found < options.min_found_ratio * l.expected;
    const bool few_keypoints = age >= options.probation && num_keypoints(map, id) < options.min_keypoints;
    if (rarely_matched || few_keypoints) bad.push_back(id);
  }
  for (const LandmarkId l : bad) draft.remove_landmark(l);
  return static_cast<int>(bad.size());
}

int cull_keyframes(KeyframeId newest, const CullingOptions& options, map::MapDraft& draft) {
  int culled = 0;
  const std::vector<map::Covisible> neighbours = draft.map().keyframe(newest).covisible;
  for (const map::Covisible& c : neighbours) {
    const bool root = !draft.map().keyframe(c.keyframe).parent.valid();
    if (root || c.keyframe.value() >= newest.value() - 2 || !draft.map().alive(c.keyframe)) continue;
    if (!redundant(draft.map(), c.keyframe, options)) continue;
    draft.remove_keyframe(c.keyframe);
    ++culled;
  }
  return culled;
}

}  // namespace bslam::mapping
