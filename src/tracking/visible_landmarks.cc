#include "tracking/visible_landmarks.h"

#include <algorithm>

#include "base/id_set.h"
#include "map/local_view.h"
#include "matching/projection_search.h"
#include "tracking/track_output.h"

namespace bslam::tracking {
namespace {

using geometry::SE3;

// Number of frames for which a local view is used while the map does not change.
constexpr int kFramesOfView = 8;

// Appends the landmarks that are predicted visible in each camera, except those flagged in `skip`. `first`: the index
// of the first landmark.
void add_visible(const TrackInput& input, const frame::BundledFrame& frame, const SE3& T_rig_world,
                 std::span<const LandmarkId> landmarks, std::span<const matching::SearchPoint> points,
                 std::span<const std::uint8_t> skip, std::size_t first, ThreadPool& pool, Candidates& out) {
  const camera::Rig rig = frame::rig_of(input.map.rig(), frame);
  const double max_view_angle = matching::ProjectionSearchOptions{}.max_view_angle;
  pool.for_each(rig.size(), [&](std::size_t c) {
    if (frame.cameras[c].state != image::ImageState::kPresent) return;
    const SE3 T_cam_world = rig.cam_from_rig(c) * T_rig_world;
    for (const auto& v : matching::visible_points(rig, CameraIndex(c), T_cam_world, points, max_view_angle)) {
      if (!skip.empty() && skip[v.point]) continue;
      out[c].push_back({landmarks[v.point], v.pixel, v.scale, static_cast<std::uint32_t>(first + v.point)});
    }
  });
}

// About `count` landmarks, spread over the image: the first ones of each cell of a grid.
void keep_spread(int count, const camera::Camera& camera, std::vector<Candidate>& candidates) {
  constexpr int kPerCell = 2;
  if (static_cast<int>(candidates.size()) <= count) return;
  const double cell = std::sqrt(static_cast<double>(camera.width) * camera.height * kPerCell / count);
  const auto columns = static_cast<std::size_t>(camera.width / cell) + 1;
  std::vector<std::uint8_t> taken(columns * (static_cast<std::size_t>(camera.height / cell) + 1));
  std::erase_if(candidates, [&](const Candidate& l) {
    const auto x = static_cast<std::size_t>(std::max(0.0, l.pixel.x() / cell));
    const auto y = static_cast<std::size_t>(std::max(0.0, l.pixel.y() / cell));
    std::uint8_t& in_cell = taken[std::min(y * columns + x, taken.size() - 1)];
    if (in_cell == kPerCell) return true;
    ++in_cell;
    return false;
  });
}

// The view of the frames before if it can still be used, else a new one around the landmarks of the last frame.
std::shared_ptr<const LocalView> local_view(const TrackInput& input, const std::vector<LandmarkId>& last,
                                            const TrackingOptions& options) {
  const map::BundledMap& map = input.map;
  const KeyframeId reference = input.state.anchored.reference;
  const DirectState& before = input.state.direct;
  if (before.view && before.view->version == map.version() && before.view->reference == reference &&
      before.frames % kFramesOfView != 0)
    return before.view;
  LocalView view{map.version(), reference, map::local_landmarks(map, last, reference, options.local_view), {}};
  view.points = map::search_points(map, view.landmarks);
  return std::make_shared<const LocalView>(std::move(view));
}

// Flags of the elements of `ids` that are also in `others`.
std::vector<std::uint8_t> contained(const std::vector<LandmarkId>& ids, const std::vector<LandmarkId>& others) {
  IdSet<LandmarkId> set(others);
  for (const LandmarkId l : others) set.insert(l);
  std::vector<std::uint8_t> out(ids.size());
  std::ranges::transform(ids, out.begin(), [&](LandmarkId l) { return set.contains(l); });
  return out;
}

// The number of landmarks to align in each image. It depends on the cameras in use, not on those that have an image in
// this frame: the landmarks found in a camera are compared with those found in its earlier images.
int budget_of_image(const TrackInput& input, TimeNs time_ns, const Candidates& candidates,
                    const DirectOptions& options) {
  int in_use = 0;
  for (std::size_t c = 0; c < candidates.size(); ++c) {
    const bool before = c < input.state.cameras.size() && !input.state.cameras[c].landmarks.empty() &&
                        to_seconds(time_ns - input.state.cameras[c].last_image_ns) <= kMaxPrediction_s;
    in_use += before || !candidates[c].empty();
  }
  const int share = options.per_rig / std::max(1, in_use);
  return std::min(options.per_image, std::max(options.min_per_image, share));
}

}  // namespace

LastLandmarks landmarks_of_last_frame(const TrackInput& input) {
  LastLandmarks out{last_landmarks(input.map, input.state), {}};
  out.points = map::search_points(input.map, out.landmarks);
  return out;
}

Candidates coarsest_landmarks(const TrackInput& input, const frame::BundledFrame& frame, const SE3& T_rig_world,
                              const LastLandmarks& last, const DirectOptions& options, ThreadPool& pool) {
  Candidates out(frame.cameras.size());
  add_visible(input, frame, T_rig_world, last.landmarks, last.points, {}, 0, pool, out);
  const int count = options.coarse_per_image * budget_of_image(input, frame.time_ns, out, options) / options.per_image;
  for (std::size_t c = 0; c < out.size(); ++c) {
    std::vector<Candidate>& candidates = out[c];
    if (static_cast<int>(candidates.size()) <= count) continue;
    std::ranges::sort(candidates, [](const Candidate& a, const Candidate& b) {
      return a.coarseness != b.coarseness ? a.coarseness > b.coarseness : a.landmark < b.landmark;
    });
    keep_spread(count, input.map.rig().camera(c), candidates);
    std::ranges::sort(candidates, {}, &Candidate::landmark);
  }
  return out;
}

LocalLandmarks local_landmarks(const TrackInput& input, const frame::BundledFrame& frame, const SE3& T_rig_world,
                               const LastLandmarks& last, const TrackingOptions& options, ThreadPool& pool) {
  LocalLandmarks out{local_view(input, last.landmarks, options), Candidates(frame.cameras.size()), {}, {}};
  const LocalView& view = *out.view;
  add_visible(input, frame, T_rig_world, last.landmarks, last.points, {}, 0, pool, out.candidates);
  std::vector<std::uint8_t> in_view(last.landmarks.size()), expected(last.landmarks.size() + view.landmarks.size());
  for (const std::vector<Candidate>& camera : out.candidates) {
    for (const Candidate& l : camera) in_view[l.index] = 1;
  }
  add_visible(input, frame, T_rig_world, view.landmarks, view.points, contained(view.landmarks, last.landmarks),
              last.landmarks.size(), pool, out.candidates);
  const int budget = budget_of_image(input, frame.time_ns, out.candidates, options.direct);
  for (std::size_t c = 0; c < out.candidates.size(); ++c) {
    std::vector<Candidate>& candidates = out.candidates[c];
    std::stable_partition(candidates.begin(), candidates.end(),
                          [&](const Candidate& l) { return expected[l.index] != 0; });
    keep_spread(budget, input.map.rig().camera(c), candidates);
    for (const Candidate& l : candidates) {
      if (!expected[l.index]) out.expected.push_back(l.landmark);
      expected[l.index] = 1;
    }
  }
  std::ranges::sort(out.expected);
  for (std::size_t i = 0; i < last.landmarks.size(); ++i) {
    if (in_view[i] && !expected[i]) out.others.push_back(last.landmarks[i]);
  }
  return out;
}

}  // namespace bslam::tracking
