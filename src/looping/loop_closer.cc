#include "looping/loop_closer.h"

#include <algorithm>

#include "looping/loop_correction.h"
#include "looping/relative_scale.h"

namespace bslam::looping {
namespace {

// On a continuous path the candidate is linked to the keyframe by the keyframes in between, and most of the matched
// landmarks are already observed by the keyframe. A revisit matches landmarks that the keyframe does not observe yet.
bool is_revisit(const map::BundledMap& map, KeyframeId keyframe, const PlaceMatch& place_match,
                const LoopOptions& options) {
  const auto known = std::ranges::count_if(place_match.matches, [&](const auto& match) {
    const std::span<const map::Observation> list = map.observations(match.second);
    return std::ranges::find(list, keyframe, &map::Observation::keyframe) != list.end();
  });
  const auto all = static_cast<double>(place_match.matches.size());
  return all - static_cast<double>(known) >= options.min_new_landmark_ratio * all;
}

// Returns, among the candidate and its best covisible keyframes, without the keyframe's own neighbours, the one that is
// closest to the verified position of the keyframe.
KeyframeId closest_keyframe_of_place(const map::BundledMap& map, KeyframeId keyframe, const PlaceMatch& place_match,
                                     const LoopingOptions& options) {
  const Eigen::Vector3d here = place_match.T_rig_world.inverse().translation();
  const auto distance = [&](KeyframeId k) {
    return (map.keyframe(k).T_rig_world.inverse().translation() - here).norm();
  };
  const auto own = neighbours_of(map, keyframe, options.recognition);
  KeyframeId best = place_match.matched_keyframe;
  for (const map::Covisible& c :
       map.best_covisible(place_match.matched_keyframe, static_cast<std::size_t>(options.verification.neighbours))) {
    const bool known =
        c.keyframe == keyframe || std::ranges::binary_search(own, c.keyframe, {}, &map::Covisible::keyframe);
    if (!known && distance(c.keyframe) < distance(best)) best = c.keyframe;
  }
  return best;
}

bool in_other_submap(const map::BundledMap& map, KeyframeId keyframe, KeyframeId candidate) {
  return map.root_of(keyframe) != map.root_of(candidate);
}

// Records that a candidate was given up after this stage.
void give_up(const map::BundledMap& map, KeyframeId keyframe, KeyframeId candidate, JoinStage after,
             JoinAttempts& attempts) {
  if (in_other_submap(map, keyframe, candidate)) attempts.farthest = std::max(attempts.farthest, after);
}

}  // namespace

LoopCloser::LoopCloser(std::unique_ptr<PlaceRecogniser> recogniser, const LoopingOptions& options,
                       const feature::FeatureModel& features, std::uint64_t seed)
    : recogniser_(std::move(recogniser)), options_(options), features_(features), seed_(seed) {}

std::optional<PlaceMatch> LoopCloser::verify(KeyframeId keyframe, const map::BundledMap& map,
                                             const PlaceCandidate& candidate, JoinAttempts& attempts) const {
  const Random random(seed_, "loop", static_cast<std::uint64_t>(keyframe.value()));
  VerificationReport report;
  auto place_match = verify_place(map, map.rig_of(keyframe), *map.keyframe(keyframe).frame, candidate.keyframe,
                                  options_.verification, features_, random, &report);
  if (!place_match && in_other_submap(map, keyframe, candidate.keyframe))
    attempts.most_inliers = std::max(attempts.most_inliers, report.inliers);
  return place_match;
}

// Submaps can have any relative pose, so no pose prior can reject a wrong match, only appearance. Therefore no other
// place in the same submap may match equally well. The candidates are searched as for relocalisation, with lower
// thresholds, because a look-alike place observed by fewer keyframes would not be a candidate in addition to the right
// one.
bool LoopCloser::is_unambiguous(KeyframeId keyframe, const map::BundledMap& map, const PlaceMatch& place_match) const {
  const std::shared_ptr<const frame::BundledFrame> frame = map.keyframe(keyframe).frame;
  const camera::Rig rig = map.rig_of(keyframe);
  map::BundledMap rest = map;
  rest.remove_submap(map.root_of(keyframe));
  const Random random(seed_, "rival", static_cast<std::uint64_t>(keyframe.value()));
  return std::ranges::none_of(recogniser_->query_frame(rest, *frame), [&](const PlaceCandidate& candidate) {
    const auto other = verify_place(rest, rig, *frame, candidate.keyframe, options_.verification, features_, random);
    return other && contradicts(rest, place_match, *other);
  });
}

LoopCloser::Found LoopCloser::closure_at(KeyframeId keyframe, const map::BundledMap& map, PlaceMatch place_match,
                                         JoinAttempts& attempts) const {
  const auto scale = relative_scale(map, keyframe, place_match);
  if (!scale) return std::nullopt;
  place_match.scale = *scale;
  place_match.matched_keyframe = closest_keyframe_of_place(map, keyframe, place_match, options_);
  const LoopClosure closure = measure(map, keyframe, place_match);
  if (!plausible(map, closure, options_.loop)) return std::nullopt;
  if (closure.merged && !is_unambiguous(keyframe, map, place_match)) {
    give_up(map, keyframe, place_match.matched_keyframe, JoinStage::kAmbiguous, attempts);
    return std::nullopt;
  }
  return std::pair(std::move(place_match), closure);
}

LoopCloser::Found LoopCloser::find(KeyframeId keyframe, const map::BundledMap& map, JoinAttempts& attempts) {
  const auto joined = joined_.find(map, keyframe, options_);
  const std::vector<PlaceCandidate> candidates = recogniser_->query_keyframe(map, keyframe);
  for (const PlaceCandidate& candidate : candidates)
    give_up(map, keyframe, candidate.keyframe, JoinStage::kNotConsistent, attempts);
  for (const PlaceCandidate& candidate : consistent_candidates(map, keyframe, candidates, options_.loop, history_)) {
    give_up(map, keyframe, candidate.keyframe, JoinStage::kNotVerified, attempts);
    auto place_match = verify(keyframe, map, candidate, attempts);
    if (!place_match) continue;
    if (!is_revisit(map, keyframe, *place_match, options_.loop)) continue;
    if (auto closure = closure_at(keyframe, map, *std::move(place_match), attempts)) return closure;
  }
  if (!joined) return std::nullopt;
  auto place_match = verify(keyframe, map, {*joined}, attempts);
  return place_match ? closure_at(keyframe, map, *std::move(place_match), attempts) : std::nullopt;
}

std::optional<LoopClosure> LoopCloser::close(KeyframeId keyframe, map::MapDraft& draft, JoinAttempts* attempts) {
  JoinAttempts so_far = attempts != nullptr ? *attempts : JoinAttempts();
  const auto found = find(keyframe, draft.map(), so_far);
  if (!found) {
    if (attempts != nullptr) *attempts = so_far;
    return std::nullopt;
  }
  const auto& [place_match, closure] = *found;
  if (closure.merged) {
    merge_submaps(closure, place_match, options_.loop, features_, draft);
    return closure;
  }
  map::MapDraft attempt = draft;
  if (!close_loop(closure, place_match, options_.loop, features_, attempt)) return std::nullopt;
  draft = std::move(attempt);
  return closure;
}

void LoopCloser::committed(const LoopClosure& closure) {
  history_ = {};
  joined_.closed(closure.keyframe);
}

}  // namespace bslam::looping
