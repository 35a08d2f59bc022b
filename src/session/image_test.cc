#include "session/image_test.h"

#include <algorithm>
#include <utility>

#include "dataset/frame_reader.h"
#include "image_decoding/image_file.h"

namespace bslam::session {

Result<std::vector<calibration::PairEvidence>> test_against_images(const dataset::Dataset& dataset) {
  constexpr std::size_t kFrames = 6;
  const auto masks = image_decoding::read_masks(dataset.rig);
  if (!masks) return masks.error();
  const std::size_t size = dataset.frames.size(), count = std::min(kFrames, size);
  std::vector<image::ImageBundle> frames;
  for (std::size_t k = 0; k < count; ++k)
    frames.push_back(dataset::read_frame(dataset, (2 * k + 1) * size / (2 * count)));
  return calibration::check_conventions(dataset.rig, frames, *masks);
}

std::optional<calibration::LateCamera> late_camera(const dataset::Dataset& dataset) {
  constexpr std::size_t kTriples = 12;
  const auto masks = image_decoding::read_masks(dataset.rig);
  const std::size_t size = dataset.frames.size();
  if (!masks || dataset.rig.size() < 2 || size < 3) return std::nullopt;
  const std::size_t count = std::min(kTriples, size / 3);
  std::vector<image::ImageBundle> triples;
  for (std::size_t t = 0; t < count; ++t) {
    const std::size_t first = (2 * t + 1) * (size - 2) / (2 * count);
    for (std::size_t f = 0; f < 3; ++f) triples.push_back(dataset::read_frame(dataset, first + f));
  }
  return calibration::find_late_camera(dataset.rig, triples, *masks);
}

PairsWithoutMap pairs_without_map(const dataset::Dataset& dataset) {
  PairsWithoutMap out;
  const auto tested = test_against_images(dataset);
  if (!tested) return out;
  for (const calibration::PairEvidence& pair : *tested) {
    out.as_given += pair.verdict == calibration::Convention::kAsGiven;
    if (!calibration::shows_another_arrangement(pair) && !pair.mirrored) continue;
    out.contradicted.push_back(
        {.first = pair.first, .second = pair.second, .overlap = pair.overlap, .evidence = pair, .contradicted = true});
  }
  return out;
}

}  // namespace bslam::session
