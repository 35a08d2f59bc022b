// Benchmark of large maps: "make" writes a map of shifted copies of a smaller map, "measure" reports the time to load a
// map, the time of place recognition, and the memory.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <string>

#include "base/memory_count.h"
#include "base/random.h"
#include "base/stopwatch.h"
#include "looping/place_recogniser.h"
#include "looping/relocalise.h"
#include "map/append_map.h"
#include "session/process_use.h"
#include "session/summary.h"
#include "storage/map_file.h"
#include "storage/vocabulary_file.h"
#include "system/config.h"

namespace bslam {
namespace {

// Time of the clock, and processor time of all threads, since its construction.
class Timer {
 public:
  double ms() const { return watch_.ms(); }
  double cpu_ms() const { return 1000 * (session::cpu_seconds().value_or(0) - cpu_); }

 private:
  Stopwatch watch_;
  double cpu_ = session::cpu_seconds().value_or(0);
};

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
  int copies = 8, bits = 30, queries = 200;
};

Status make(const Arguments& a) {
  const auto saved = storage::read_map(a.map);
  if (!saved) return saved.error();
  const auto vocabulary = storage::vocabulary_or_shipped("");
  if (!vocabulary) return vocabulary.error();
  Random random(1, "large map");
  map::BundledMap all(saved->map.shared_rig(), saved->map.pyramid());
  all.set_scale(saved->map.scale());
  map::append_map(all, saved->map);
  for (int i = 1; i < a.copies; ++i)
    map::append_map(all, copy_of(saved->map, 2000.0 * i, a.bits, **vocabulary, random));
  all.release_unused(all.keyframe_slots());  // as a run does while it goes on
  const Status written = storage::write_map(all, saved->info, a.out);
  fmt::print("{} keyframes, {} landmarks\n", all.num_keyframes(), all.num_landmarks());
  return written;
}

class Series {
 public:
  explicit Series(const char* name) : name_(name) {}
  void add(const Timer& timer) {
    ms_.push_back(timer.ms());
    cpu_ms_.push_back(timer.cpu_ms());
  }
  void print() const {
    const auto clock = session::duration_statistics(ms_), processor = session::duration_statistics(cpu_ms_);
    fmt::print("{}: {:.2f} ms, 95 % {:.2f} ms; processor {:.2f} ms, 95 % {:.2f} ms\n", name_, clock.median, clock.p95,
               processor.median, processor.p95);
  }

 private:
  const char* name_;
  std::vector<double> ms_, cpu_ms_;
};

void print_memory(const char* when) {
  fmt::print("memory {}: {:.0f} MB, at most {:.0f} MB\n", when, session::resident_memory_mb().value_or(0),
             session::peak_memory_mb().value_or(0));
}

// Frames that look like a keyframe of the map, except for some descriptor bits.
void measure_queries(const map::BundledMap& map, looping::PlaceRecogniser& places, const place::Vocabulary& vocabulary,
                     const system::Config& config, const Arguments& a) {
  Random random(2, "queries");
  Series of_frame("query of a frame"), of_keyframe("query of a keyframe"), localised("localisation by features");
  std::size_t candidates = 0, first = 0, found = 0;
  for (int i = 0; i < a.queries; ++i) {
    const KeyframeId k(std::size_t{random.below(static_cast<std::uint32_t>(map.keyframe_slots()))});
    const auto frame = changed(*map.keyframe(k).frame, a.bits, vocabulary, random);
    const Timer query;
    const auto ranked = places.query_frame(map, *frame);
    of_frame.add(query);
    candidates += ranked.size();
    first += !ranked.empty() && ranked.front().keyframe == k;
    const Timer query_keyframe;
    places.query_keyframe(map, k);
    of_keyframe.add(query_keyframe);
    const Timer localisation;
    const auto place = looping::relocalise(
        places, map, *frame, [](const looping::PlaceMatch&) { return true; }, config.looping.verification,
        config.feature_model(), random);
    localised.add(localisation);
    found += place && (place->T_rig_world * map.keyframe(k).T_rig_world.inverse()).translation().norm() < 0.5;
  }
  of_frame.print();
  of_keyframe.print();
  localised.print();
  fmt::print("of {}: {} candidates, the first is the keyframe {} times; {} localised within 0.5 m\n", a.queries,
             candidates, first, found);
}

Status measure(const Arguments& a) {
  const Timer loading;
  const auto saved = storage::read_map(a.map);
  if (!saved) return saved.error();
  const map::BundledMap& map = saved->map;
  fmt::print("load: {:.0f} ms, processor {:.0f} ms; {} keyframes, {} landmarks\n", loading.ms(), loading.cpu_ms(),
             map.num_keyframes(), map.num_landmarks());
  print_memory("after loading");
  MemoryCount count;
  const map::MapMemory memory = map.memory(count);
  fmt::print(
      "map: {} MB; keyframes {}, features {}, descriptors {}, patches {}, words {}, landmarks {}, observations {}, "
      "covisibility {}\n",
      memory.total() >> 20, memory.keyframes >> 20, memory.features >> 20, memory.descriptors >> 20,
      memory.patches >> 20, memory.words >> 20, memory.landmarks >> 20, memory.observations >> 20,
      memory.covisibility >> 20);
  const auto vocabulary = storage::vocabulary_or_shipped("");
  if (!vocabulary) return vocabulary.error();
  const system::Config config;
  looping::BagOfWordsRecogniser places(*vocabulary, config.looping.recognition);
  const Timer indexing;
  places.query_frame(map, frame::BundledFrame());
  fmt::print("index of places: {:.0f} ms, processor {:.0f} ms, {} MB\n", indexing.ms(), indexing.cpu_ms(),
             places.memory_bytes() >> 20);
  print_memory("with the index");
  measure_queries(map, places, **vocabulary, config, a);
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
  make->add_option("--copies", a.copies, "number of copies, including the unchanged map")->capture_default_str();
  make->add_option("--bits", a.bits, "bits of each descriptor that are changed in each copy")->capture_default_str();
  CLI::App* const measure = app.add_subcommand("measure", "measures loading, memory and recognition of places");
  measure->add_option("map", a.map, "a saved map")->required();
  measure->add_option("--bits", a.bits, "bits of each descriptor of a query that are changed")->capture_default_str();
  measure->add_option("--queries", a.queries, "number of places that are queried")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  const bslam::Status status = *make ? bslam::make(a) : bslam::measure(a);
  if (!status) fmt::print(stderr, "{}\n", status.error().message());
  return status ? 0 : 2;
}
