#include "looping/loop_closer.h"

#include <algorithm>

#include "looping/loop_correction.h"
#include "looping/relative_scale.h"

namespace bslam::looping {
namespace {

// On an unbroken walk a candidate is joined to the keyframe by those between them, and what is found of it is what the
// keyframe observes anyway. A place seen again shows landmarks that the keyframe does not know.
bool shows_news(const map::BundledMap& map, KeyframeId keyframe, const Location& location) {
  const auto known = std::ranges::count_if(location.matches, [&](const auto& match) {
    const std::span<const map::Observation> list = map.observations(match.second);
    return std::ranges::find(list, keyframe, &map::Observation::keyframe) != list.end();
  });
  return 2 * static_cast<std::size_t>(known) < location.matches.size();
}

}  // namespace

LoopCloser::LoopCloser(std::unique_ptr<PlaceRecogniser> recogniser, const LoopingOptions& options, const map::FeatureModel& features,
                       std::uint64_t seed)
    : recogniser_(std::move(recogniser)), options_(options), features_(features), seed_(seed) {}

std::optional<Location> LoopCloser::find(KeyframeId keyframe, const map::BundledMap& map) {
  const std::vector<Candidate> candidates =
      consistent_candidates(map, keyframe, recogniser_->revisited(map, keyframe), options_.loop, history_);
  for (const Candidate& candidate : candidates) {
    const Random random(seed_, "loop", static_cast<std::uint64_t>(keyframe.value()));
    auto location = locate(map, *map.keyframe(keyframe).frame, candidate.keyframe, options_.verification, features_, random);
    if (!location || !shows_news(map, keyframe, *location)) continue;
    const auto scale = relative_scale(map, keyframe, *location);
    if (!scale) continue;
    location->scale = *scale;
    if (plausible(map, measure(map, keyframe, *location), options_.loop)) return location;
  }
  return std::nullopt;
}

std::optional<LoopClosure> LoopCloser::close(KeyframeId keyframe, map::MapDraft& draft) {
  if (last_.valid() && keyframe <= last_) history_ = {};
  last_ = keyframe;
  const auto location = find(keyframe, draft.map());
  if (!location) return std::nullopt;
  const LoopClosure closure = measure(draft.map(), keyframe, *location);
  if (!closure.joined) {
    close_loop(closure, *location, options_.loop, features_, draft);
  } else if (!join_parts(closure, *location, options_.loop, features_, draft)) {
    return std::nullopt;
  }
  history_ = {};
  return closure;
}

}  // namespace bslam::looping
