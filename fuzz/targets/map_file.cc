// Saved maps: unchanged inputs, and inputs with corrected sizes and checksums, so that the code behind these checks is
// reached.
#include "storage/map_file.h"

#include <algorithm>
#include <cstring>
#include <memory>

#include "base/random.h"
#include "storage/map_checksum.h"
#include "target.h"

namespace bslam::fuzz {
namespace {

// docs/map_file.md
constexpr std::size_t kTotal = 20, kTable = 28, kEntry = 16, kSections = 4, kHeader = kTable + kSections * kEntry + 4;

template <class T>
void set(std::string& bytes, std::size_t at, T value) {
  std::memcpy(bytes.data() + at, &value, sizeof(T));
}

void repair(std::string& bytes) {
  set(bytes, kTotal, std::uint64_t{bytes.size()});
  std::size_t at = kHeader;
  ThreadPool pool(1);
  for (std::size_t i = 0; i < kSections; ++i) {
    std::uint64_t size = 0;
    std::memcpy(&size, bytes.data() + kTable + i * kEntry + 8, sizeof(size));
    const std::uint64_t rest = bytes.size() - at;
    size = i + 1 == kSections ? rest : std::min(rest, size);
    set(bytes, kTable + i * kEntry + 4, storage::section_checksum(std::string_view(bytes).substr(at, size), pool));
    set(bytes, kTable + i * kEntry + 8, size);
    at += size;
  }
  set(bytes, kHeader - 4, storage::crc32_of(std::string_view(bytes).substr(0, kHeader - 4)));
}

void check(std::string_view bytes) {
  const auto saved = storage::map_from_bytes(bytes, "fuzz");
  if (!saved) return require(!saved.error().message().empty(), "an error must have a message");
  const std::string again = storage::map_to_bytes(saved->map, saved->info);
  constexpr std::size_t kVersion = 12;  // files of earlier versions have no gaps between arrays
  require(bytes[kVersion] != again[kVersion] || again.size() <= bytes.size(),
          "a map must not become larger when written again");
  const auto twice = storage::map_from_bytes(again, "fuzz");
  require(twice.ok() && storage::map_to_bytes(twice->map, twice->info) == again,
          "a written map must be read back equal");
}

std::shared_ptr<const frame::BundledFrame> small_frame(Random& random, std::size_t cameras, std::size_t keypoints) {
  auto frame = std::make_shared<frame::BundledFrame>();
  frame->cameras.resize(cameras);
  for (frame::CameraFrame& c : frame->cameras) {
    c.state = image::ImageState::kPresent;
    feature::Detections detections;
    std::vector<WordId> words;
    for (std::size_t k = 0; k < keypoints; ++k) {
      detections.pixel.emplace_back(static_cast<float>(random.uniform(0, 639)),
                                    static_cast<float>(random.uniform(0, 479)));
      detections.level.push_back(static_cast<std::uint8_t>(random.below(8)));
      detections.angle.push_back(0.5f);
      detections.sigma.push_back(1.0f);
      detections.bearing.push_back(Eigen::Vector3d::UnitZ());
      detections.descriptor.push_back({random.next(), random.next(), random.next(), random.next()});
      detections.patch.emplace_back();
      words.emplace_back(static_cast<std::int32_t>(random.below(100)));
    }
    c.keypoints = std::move(detections);
    c.words = std::move(words);
  }
  std::vector<std::vector<frame::KeypointRef>> groups;
  std::vector<std::optional<frame::BundledPoint>> points;
  for (std::size_t f = 0; cameras > 1 && f < keypoints / 2; ++f) {
    groups.push_back({{CameraIndex(0), KeypointIndex(f)}, {CameraIndex(1), KeypointIndex(f)}});
    points.emplace_back();
    if (f % 2 == 0) points.back() = frame::BundledPoint{{0, 0, 3}, Eigen::Matrix3d::Identity()};
  }
  const std::vector<std::size_t> counts(cameras, keypoints);
  frame->bundled = frame::Bundled(counts, groups, points);
  return frame;
}

std::string small_map(std::size_t cameras) {
  Random random(7, "fuzz map", cameras);
  std::vector<camera::RigCamera> list;
  for (std::size_t c = 0; c < cameras; ++c) {
    const camera::CameraModel model =
        c % 2 == 0 ? camera::CameraModel(camera::PinholeRadTan({400, 400, 320, 240}, {-0.28, 0.07, 1e-4, 1e-5}))
                   : camera::CameraModel(camera::KannalaBrandt({300, 300, 320, 240}, {0.01, 0.001, 0, 0}));
    list.push_back({{"cam" + std::to_string(c), model, 640, 480, 0, {}}, {}});
  }
  map::BundledMap map(std::make_shared<const camera::Rig>(std::move(list)));
  for (int i = 0; i < 4; ++i)
    map.add_keyframe(small_frame(random, cameras, 6), {}, {}, i == 3 ? KeyframeId() : map.newest_keyframe());
  for (std::size_t f = 0; f < 5; ++f) {
    const std::vector<map::Observation> seen = {
        {KeyframeId(0), FeatureId(f)}, {KeyframeId(1), FeatureId(f)}, {KeyframeId(3), FeatureId(f), false}};
    map.add_landmark({0, 0, 4}, seen);
  }
  return storage::map_to_bytes(map, {1, "0.1.0", "fuzz"});
}

}  // namespace

std::vector<std::string> seeds() { return {small_map(1), small_map(2), small_map(3)}; }

}  // namespace bslam::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace bslam::fuzz;
  std::string bytes(as_text(data, size));
  check(bytes);
  if (bytes.size() < kHeader) return 0;
  repair(bytes);
  check(bytes);
  return 0;
}
