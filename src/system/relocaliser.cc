#include "system/relocaliser.h"

#include "looping/relocalise.h"

namespace bslam::system {
namespace {

tracking::FoundPlace found_place(const looping::PlaceMatch& place) {
  return {place.matched_keyframe, place.T_rig_world, place.matches, place.inliers, place.found_ratio};
}

}  // namespace

PlaceRelocaliser::PlaceRelocaliser(std::unique_ptr<looping::PlaceRecogniser> recogniser, const Config& config)
    : recogniser_(std::move(recogniser)),
      options_(config.looping.verification),
      features_(config.feature_model()),
      seed_(static_cast<std::uint64_t>(config.seed)) {}

void PlaceRelocaliser::describe(frame::BundledFrame& frame) const { recogniser_->describe(frame); }

std::optional<tracking::FoundPlace> PlaceRelocaliser::verify_place(
    const map::BundledMap& map, const frame::BundledFrame& frame,
    const std::function<bool(const tracking::FoundPlace&)>& plausible) {
  const Random random(seed_, "relocalise", static_cast<std::uint64_t>(frame.id.value()));
  const auto found = looping::relocalise(
      *recogniser_, map, frame, [&](const looping::PlaceMatch& place) { return plausible(found_place(place)); },
      options_, features_, random);
  return found ? std::optional(found_place(*found)) : std::nullopt;
}

std::unique_ptr<tracking::Relocaliser> make_relocaliser(const place::VocabularyPtr& vocabulary, const Config& config) {
  if (!vocabulary) return nullptr;
  auto recogniser = std::make_unique<looping::BagOfWordsRecogniser>(vocabulary, config.looping.recognition);
  return std::make_unique<PlaceRelocaliser>(std::move(recogniser), config);
}

}  // namespace bslam::system
