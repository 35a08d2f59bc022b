#include "session/image_test.h"

#include <algorithm>
#include <cstdlib>
#include <tuple>
#include <utility>

#include "dataset/frame_reader.h"
#include "image_decoding/image_file.h"

namespace bslam::session {

namespace {

// Up to `count` frames in equal parts of the recording. In each part, the frame with the most pairs of cameras that no
// chosen frame has, then with the most images, then the one nearest to the middle of the part: cameras of a lower rate
// have images in few frames.
std::vector<std::size_t> frames_with_all_pairs(const dataset::Dataset& dataset, std::size_t count) {
  const std::size_t size = dataset.frames.size(), cameras = dataset.rig.size();
  std::vector<std::uint8_t> seen(cameras * cameras, 0);
  const auto for_each_pair = [&](std::size_t f, const auto& visit) {
    const auto& images = dataset.frames[f].images;
    for (std::size_t i = 0; i < cameras; ++i) {
      for (std::size_t j = i; j < cameras; ++j) {
        if (images[i] && images[j]) visit(i * cameras + j, i == j);
      }
    }
  };
  std::vector<std::size_t> out;
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t begin = k * size / count, end = (k + 1) * size / count, middle = (begin + end) / 2;
    std::tuple<int, int, std::ptrdiff_t> best{-1, 0, 0};
    std::size_t chosen = middle;
    for (std::size_t f = begin; f < end; ++f) {
      int added = 0, images = 0;
      for_each_pair(f, [&](std::size_t pair, bool single) {
        added += !single && !seen[pair];
        images += single;
      });
      const std::tuple rank{added, images,
                            -std::abs(static_cast<std::ptrdiff_t>(f) - static_cast<std::ptrdiff_t>(middle))};
      if (rank > best) std::tie(best, chosen) = std::pair(rank, f);
    }
    for_each_pair(chosen, [&](std::size_t pair, bool) { seen[pair] = 1; });
    out.push_back(chosen);
  }
  return out;
}

}  // namespace

Result<std::vector<calibration::PairEvidence>> test_against_images(const dataset::Dataset& dataset) {
  constexpr std::size_t kFrames = 6;
  const auto masks = image_decoding::read_masks(dataset.rig);
  if (!masks) return masks.error();
  std::vector<image::ImageBundle> frames;
  for (const std::size_t f : frames_with_all_pairs(dataset, std::min(kFrames, dataset.frames.size())))
    frames.push_back(dataset::read_frame(dataset, f));
  return calibration::check_conventions(dataset.rig, frames, *masks);
}

std::optional<calibration::LateCamera> late_camera(const dataset::Dataset& dataset, const camera::Rig& estimated) {
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
  return calibration::find_late_camera(dataset.rig, estimated, triples, *masks);
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
