// Relocalisation by place recognition and geometric verification (looping/relocalise.h), for the tracker.
#pragma once

#include <memory>

#include "looping/place_recogniser.h"
#include "system/config.h"
#include "tracking/relocaliser.h"

namespace bslam::system {

class PlaceRelocaliser : public tracking::Relocaliser {
 public:
  PlaceRelocaliser(std::unique_ptr<looping::PlaceRecogniser> recogniser, const Config& config);

  void describe(frame::BundledFrame& frame) const override;
  std::optional<tracking::FoundPlace> verify_place(
      const map::BundledMap& map, const frame::BundledFrame& frame,
      const std::function<bool(const tracking::FoundPlace&)>& plausible) override;
  std::size_t memory_bytes() const override { return recogniser_->memory_bytes(); }

 private:
  const std::unique_ptr<looping::PlaceRecogniser> recogniser_;
  const looping::VerificationOptions options_;
  const feature::FeatureModel features_;
  const std::uint64_t seed_;
};

// Returns null without a vocabulary; then no place is recognised.
std::unique_ptr<tracking::Relocaliser> make_relocaliser(const place::VocabularyPtr& vocabulary, const Config& config);

}  // namespace bslam::system
