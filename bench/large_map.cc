// Large maps: makes one of copies of a smaller map beside each other, and measures what it takes to load it, to find
// places in it, and to hold it.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <string>

#include "base/memory_count.h"
#include "base/random.h"
#include "looping/place_recogniser.h"
#include "looping/verify_place.h"
#include "map/append_map.h"
#include "session/process_use.h"
#include "storage/map_file.h"
#include "storage/vocabulary_file.h"
#include "system/config.h"

namespace bslam {
namespace {

using Clock = std::chrono::steady_clock;

double ms_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

// A frame of another place that looks about as different as two places of one town: some bits of all descriptors
// differ.
std::shared_ptr<const frame::BundledFrame> changed(frame::BundledFrame frame, int bits,
                                                   const place::Vocabulary& vocabulary, Random& random) {
  for (frame::CameraFrame& c : frame.cameras) {
    std::vector<feature::Descriptor> descriptors = c.keypoints.descriptor.copy();
    for (feature::Descriptor& d : descriptors) {
      for (int i = 0; i < bits; ++i) {
        const std::uint32_t bit = random.below(256);
        d[bit / 64] ^= std::uint64_t{1} << (bit % 64);
      }
    }
    std::vector<WordId> words(descriptors.size());
    vocabulary.words(descriptors, words);
    c.keypoints.descriptor = std::move(descriptors);
    c.words = std::move(words);
  }
  return std::make_shared<const frame::BundledFrame>(std::move(frame));
}

// The map moved along x, with changed appearance.
map::BundledMap copy_of(const map::BundledMap& source, double shift, int bits, const place::Vocabulary& vocabulary,
                        Random& random) {
  map::BundledMap out(source.shared_rig(), source.pyramid());
  out.set_scale(source.scale());
  const Eigen::Vector3d by(shift, 0, 0);
  std::vector<KeyframeId> parents;
  for (const KeyframeId k : source.keyframe_ids()) {
    const map::BundledKeyframe& entry = source.keyframe(k);
    const geometry::SE3 T_rig_world = entry.T_rig_world * geometry::SE3(Eigen::Quaterniond::Identity(), by).inverse();
    out.add_keyframe(changed(*entry.frame, bits, vocabulary, random), T_rig_world, {}, {});
    out.set_twist(out.newest_keyframe(), entry.twist);
    parents.push_back(entry.parent);
  }
  map::attach_keyframes(out, KeyframeId(0), parents);
  for (const LandmarkId l : source.landmark_ids()) {
    const map::Landmark& landmark = source.landmark(l);
    const auto observations = source.observations(l);
    const LandmarkId added = out.add_landmark(landmark.position + by, observations, landmark.reference, landmark.born);
    out.add_visibility_counts(added, landmark.expected, landmark.found);
  }
  return out;
}

struct Arguments {
  std::string map, out;
  int copies = 8, bits = 40, queries = 200;
};

Status make(const Arguments& a) {
  const auto saved = storage::read_map(a.map);
  if (!saved) return saved.error();
  const auto vocabulary = storage::vocabulary_or_shipped("");
  if (!vocabulary) return vocabulary.error();
  Random random(1, "large map");
  map::BundledMap all = saved->map;
  for (int i = 1; i < a.copies; ++i)
    map::append_map(all, copy_of(saved->map, 2000.0 * i, a.bits, **vocabulary, random));
  const Status written = storage::write_map(all, saved->info, a.out);
  fmt::print("{} keyframes, {} landmarks\n", all.num_keyframes(), all.num_landmarks());
  return written;
}

void print(const char* name, std::vector<double> ms) {
  if (ms.empty()) return;
  std::sort(ms.begin(), ms.end());
  const auto at = [&](double q) { return ms[static_cast<std::size_t>(q * static_cast<double>(ms.size() - 1))]; };
  fmt::print("{}: {:.2f} ms, 95 % {:.2f} ms, at most {:.2f} ms\n", name, at(0.5), at(0.95), ms.back());
}

void print_memory(const char* when) {
  fmt::print("memory {}: {:.0f} MB, at most {:.0f} MB\n", when, session::resident_memory_mb().value_or(0),
             session::peak_memory_mb().value_or(0));
}

Status measure(const Arguments& a) {
  Clock::time_point start = Clock::now();
  const auto saved = storage::read_map(a.map);
  if (!saved) return saved.error();
  fmt::print("load: {:.0f} ms; {} keyframes, {} landmarks\n", ms_since(start), saved->map.num_keyframes(),
             saved->map.num_landmarks());
  print_memory("after loading");
  MemoryCount count;
  fmt::print("map in memory of its own: {:.0f} MB\n",
             static_cast<double>(saved->map.memory(count).total()) / (1 << 20));
  const auto vocabulary = storage::vocabulary_or_shipped("");
  if (!vocabulary) return vocabulary.error();
  const system::Config config;
  looping::BagOfWordsRecogniser places(*vocabulary, config.looping.recognition);
  start = Clock::now();
  places.query_frame(saved->map, frame::BundledFrame());
  fmt::print("index of places: {:.0f} ms, {:.0f} MB\n", ms_since(start),
             static_cast<double>(places.memory_bytes()) / (1 << 20));
  print_memory("with the index");
  Random random(2, "queries");
  std::vector<double> frames, keyframes;
  std::size_t candidates = 0, found = 0;
  for (int i = 0; i < a.queries; ++i) {
    const KeyframeId k(std::size_t{random.below(static_cast<std::uint32_t>(saved->map.keyframe_slots()))});
    start = Clock::now();
    const auto of_frame = places.query_frame(saved->map, *saved->map.keyframe(k).frame);
    frames.push_back(ms_since(start));
    candidates += of_frame.size();
    for (const auto& c : of_frame) found += c.keyframe == k;
    start = Clock::now();
    places.query_keyframe(saved->map, k);
    keyframes.push_back(ms_since(start));
  }
  print("query of a frame", frames);
  print("query of a keyframe", keyframes);
  fmt::print("{} candidates, of which {} are the keyframe itself\n", candidates, found);
  print_memory("after the queries");
  return {};
}

}  // namespace
}  // namespace bslam

int main(int argc, char** argv) {
  CLI::App app("large maps: makes them and measures them");
  app.require_subcommand(1);
  bslam::Arguments a;
  CLI::App* const make = app.add_subcommand("make", "writes a map of shifted copies of a map");
  make->add_option("map", a.map, "a saved map")->required();
  make->add_option("out", a.out, "the map to write")->required();
  make->add_option("--copies", a.copies, "number of copies")->capture_default_str();
  make->add_option("--bits", a.bits, "bits of each descriptor that are changed in each copy")->capture_default_str();
  CLI::App* const measure = app.add_subcommand("measure", "measures loading, memory and recognition of places");
  measure->add_option("map", a.map, "a saved map")->required();
  measure->add_option("--queries", a.queries, "number of places that are queried")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  const bslam::Status status = *make ? bslam::make(a) : bslam::measure(a);
  if (!status) fmt::print(stderr, "{}\n", status.error().message());
  return status ? 0 : 2;
}
