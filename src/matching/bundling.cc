#include "matching/bundling.h"

#include <algorithm>
#include <numeric>

#include "frame/capture_times.h"
#include "matching/epipolar_search.h"
#include "matching/point_estimation.h"

namespace bslam::matching {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// A match of keypoints of two cameras, with the aligned position of the second.
struct Edge {
  frame::KeypointRef a, b;
  int hamming = 0;
  AlignedKeypoint aligned;
  Vector3d bearing;  // bearing of the aligned pixel
};

struct CameraPair {
  CameraIndex a, b;
};

std::vector<CameraPair> overlapping_pairs(const camera::Rig& rig) {
  std::vector<CameraPair> pairs;
  for (std::size_t i = 0; i < rig.size(); ++i) {
    for (std::size_t j = i + 1; j < rig.size(); ++j) {
      if (rig.share_view(i, j)) pairs.push_back({CameraIndex(i), CameraIndex(j)});
    }
  }
  return pairs;
}

// `positions`: Keypoints or Refinement of the camera of `ref`.
template <class Positions>
PointObservation observation(const camera::Rig& rig, const Positions& positions, frame::KeypointRef ref) {
  const std::size_t i = ref.keypoint.index();
  const Vector2d pixel = positions.pixel[i].template cast<double>();
  return {&rig.camera(ref.camera), rig.cam_from_rig(ref.camera, pixel.y()), pixel, positions.bearing[i],
          positions.sigma[i]};
}

// Aligns keypoint b of an edge to the patch of keypoint a. Returns false if the alignment fails.
bool align_edge(const camera::Rig& rig, std::span<const frame::CameraFrame> cameras,
                std::span<const image::Pyramid> pyramids, std::span<const AlignmentOptions> alignment, Edge& edge) {
  const feature::Keypoints& ka = cameras[edge.a.camera.index()].keypoints;
  const feature::Keypoints& kb = cameras[edge.b.camera.index()].keypoints;
  const std::size_t ia = edge.a.keypoint.index(), ib = edge.b.keypoint.index();
  const geometry::SE3 T_b_a = rig.cam_from_rig(edge.b.camera) * rig.rig_from_cam(edge.a.camera.index());
  const std::array<PointObservation, 2> pair = {observation(rig, ka, edge.a), observation(rig, kb, edge.b)};
  const double far_m = 1000.0 * T_b_a.translation().norm();
  const auto estimated = estimate_point(pair, 1e-4);
  const Vector3d point_a =
      estimated ? rig.cam_from_rig(edge.a.camera) * estimated->point : (far_m * ka.bearing[ia]).eval();
  const image::Pyramid& pyramid_a = pyramids[edge.a.camera.index()];
  const auto warp =
      patch_warp(rig.camera(edge.a.camera), rig.camera(edge.b.camera), T_b_a, point_a, pyramid_a.scale_x[ka.level[ia]]);
  if (!warp) return false;
  const auto aligned = align_patch(ka.patch[ia], *warp, pyramids[edge.b.camera.index()], kb.pixel[ib].cast<double>(),
                                   alignment[edge.b.camera.index()]);
  if (!aligned) return false;
  const auto bearing = rig.camera(edge.b.camera).unproject(aligned->pixel);
  if (!bearing) return false;
  edge.aligned = *aligned;
  edge.bearing = *bearing;
  return true;
}

std::vector<Edge> match_pair(const camera::Rig& rig, std::span<const frame::CameraFrame> cameras,
                             std::span<const image::Pyramid> pyramids, CameraPair pair, const BundlingOptions& options,
                             std::span<const AlignmentOptions> alignment) {
  const auto view = [&](CameraIndex c) {
    return EpipolarView{.camera = &rig.camera(c),
                        .keypoints = &cameras[c.index()].keypoints,
                        .T_common_cam = rig.rig_from_cam(c.index()),
                        .shutter = rig.shutter(c.index())};
  };
  const EpipolarView a = view(pair.a), b = view(pair.b);
  const EpipolarOptions search{.min_depth_m = options.min_depth_m,
                               .sigmas = options.sigmas,
                               .max_hamming = options.max_hamming,
                               .ratio = options.ratio,
                               .max_level_difference = 2,
                               .scale_factor = pyramids[pair.a.index()].factor};
  std::vector<Edge> edges;
  for (const EpipolarMatch& m : match_epipolar(a, b, search)) {
    Edge edge{{pair.a, m.a}, {pair.b, m.b}, m.hamming, {}, {}};
    if (align_edge(rig, cameras, pyramids, alignment, edge)) edges.push_back(edge);
  }
  return edges;
}

// Groups of keypoints joined by edges, which must be added in order of strength. An edge that would join two keypoints
// of one camera is ignored.
class Grouping {
 public:
  explicit Grouping(std::span<const frame::CameraFrame> cameras) {
    begin_.push_back(0);
    for (const frame::CameraFrame& c : cameras) begin_.push_back(begin_.back() + c.keypoints.size());
    group_of_.assign(begin_.back(), -1);
  }

  bool join(frame::KeypointRef a, frame::KeypointRef b) {
    int& ga = group_of_[index_of(a)];
    int& gb = group_of_[index_of(b)];
    if (ga >= 0 && ga == gb) return false;
    std::vector<frame::KeypointRef> merged = members(ga, a);
    const std::vector<frame::KeypointRef> other = members(gb, b);
    merged.insert(merged.end(), other.begin(), other.end());
    std::sort(merged.begin(), merged.end());
    for (std::size_t i = 1; i < merged.size(); ++i) {
      if (merged[i - 1].camera == merged[i].camera) return false;
    }
    if (gb >= 0) groups_[static_cast<std::size_t>(gb)].clear();
    const int target = ga >= 0 ? ga : static_cast<int>(groups_.size());
    if (ga < 0) groups_.emplace_back();
    for (const frame::KeypointRef r : merged) group_of_[index_of(r)] = target;
    groups_[static_cast<std::size_t>(target)] = std::move(merged);
    return true;
  }

  std::vector<std::vector<frame::KeypointRef>> take() {
    std::erase_if(groups_, [](const auto& g) { return g.size() < 2; });
    return std::move(groups_);
  }

 private:
  std::size_t index_of(frame::KeypointRef r) const { return begin_[r.camera.index()] + r.keypoint.index(); }
  std::vector<frame::KeypointRef> members(int group, frame::KeypointRef self) const {
    return group < 0 ? std::vector<frame::KeypointRef>{self} : groups_[static_cast<std::size_t>(group)];
  }
  std::vector<std::size_t> begin_;
  std::vector<int> group_of_;
  std::vector<std::vector<frame::KeypointRef>> groups_;
};

// Positions of the keypoints of all cameras, aligned along the edges of features.
class AlignedPositions {
 public:
  explicit AlignedPositions(std::span<const frame::CameraFrame> detected) : detected_(detected) {
    for (const frame::CameraFrame& c : detected) {
      positions_.push_back(c.keypoints.positions());
      role_.emplace_back(c.keypoints.size(), kDetected);
    }
  }

  // Sets the aligned position of the edge's second keypoint. The first one defines the feature, so that its position is
  // exact. An edge is ignored if its first keypoint is aligned to another one, because it refers to the old position,
  // or if its second keypoint is already aligned or is the reference of another keypoint.
  void align(const Edge& edge, std::span<const image::Pyramid> pyramids, std::span<const AlignmentOptions> alignment) {
    if (role(edge.a) == kAligned || role(edge.b) != kDetected) return;
    role(edge.a) = kReference;
    role(edge.b) = kAligned;
    const std::size_t camera_a = edge.a.camera.index(), ia = edge.a.keypoint.index(), ib = edge.b.keypoint.index();
    const double scale_a = pyramids[camera_a].scale_x[detected_[camera_a].keypoints.level[ia]];
    feature::Refinement &a = positions_[camera_a], &b = positions_[edge.b.camera.index()];
    a.sigma[ia] = std::min(a.sigma[ia], static_cast<float>(alignment[camera_a].sigma(0.0, scale_a)));
    b.pixel[ib] = edge.aligned.pixel.cast<float>();
    b.bearing[ib] = edge.bearing;
    b.sigma[ib] = static_cast<float>(edge.aligned.sigma);
  }

  const feature::Refinement& operator[](CameraIndex c) const { return positions_[c.index()]; }

  // Aligned positions of the keypoints in `groups`, detected positions of all other keypoints.
  std::vector<feature::Refinement> of_groups(std::span<const std::vector<frame::KeypointRef>> groups) && {
    for (const auto& group : groups) {
      for (const frame::KeypointRef r : group) role(r) = kDetected;  // the remaining roles are outside the groups
    }
    for (std::size_t c = 0; c < positions_.size(); ++c) {
      const feature::Keypoints& detected = detected_[c].keypoints;
      for (std::size_t k = 0; k < detected.size(); ++k) {
        if (role_[c][k] == kDetected) continue;
        positions_[c].pixel[k] = detected.pixel[k];
        positions_[c].bearing[k] = detected.bearing[k];
        positions_[c].sigma[k] = detected.sigma[k];
      }
    }
    return std::move(positions_);
  }

 private:
  enum Role : std::uint8_t { kDetected, kReference, kAligned };
  std::uint8_t& role(frame::KeypointRef r) { return role_[r.camera.index()][r.keypoint.index()]; }

  std::span<const frame::CameraFrame> detected_;
  std::vector<feature::Refinement> positions_;   // per camera
  std::vector<std::vector<std::uint8_t>> role_;  // per camera and keypoint
};

// Returns true if all keypoints of the group have the same direction within their noise: the feature is too far for a
// point.
bool agrees_at_infinity(std::span<const PointObservation> group, double max_chi2) {
  constexpr double kFar_m = 1e5;
  const PointObservation& first = group.front();
  const Vector3d point_rig = first.T_cam_common.inverse() * (kFar_m * first.bearing);
  return std::all_of(group.begin() + 1, group.end(), [&](const PointObservation& o) {
    const auto pixel = o.camera->project(o.T_cam_common * point_rig);
    return pixel && (*pixel - o.pixel).squaredNorm() <= max_chi2 * (o.sigma * o.sigma + first.sigma * first.sigma);
  });
}

// Removes the keypoint with the largest error until the rest agrees with one point. Returns false if fewer than two
// remain, or if no point can be estimated from the rest and its directions differ.
bool keep_agreeing(const camera::Rig& rig, const AlignedPositions& positions, double max_chi2,
                   std::vector<frame::KeypointRef>& group) {
  while (group.size() >= 2) {
    std::vector<PointObservation> observations;
    for (const frame::KeypointRef ref : group) observations.push_back(observation(rig, positions[ref.camera], ref));
    const auto estimated = estimate_point(observations, 0.0);
    if (!estimated) {  // the rays diverge because of their noise
      return agrees_at_infinity(observations, max_chi2);
    }
    if (estimated->worst_chi2 <= max_chi2) return true;
    group.erase(group.begin() + static_cast<std::ptrdiff_t>(estimated->worst));
  }
  return false;
}

}  // namespace

std::optional<frame::BundledPoint> triangulate_group(const camera::Rig& rig,
                                                     std::span<const frame::CameraFrame> cameras,
                                                     std::span<const frame::KeypointRef> group, double min_parallax,
                                                     double max_chi2) {
  std::vector<PointObservation> observations;
  for (const frame::KeypointRef ref : group) {
    observations.push_back(observation(rig, cameras[ref.camera.index()].keypoints, ref));
  }
  const auto estimated = estimate_point(observations, min_parallax);
  if (!estimated || estimated->worst_chi2 > max_chi2) return std::nullopt;
  return frame::BundledPoint{estimated->point, estimated->covariance};
}

frame::Bundled make_bundled(const camera::Rig& rig, std::span<const frame::CameraFrame> cameras,
                            std::span<const std::vector<frame::KeypointRef>> matched, double min_parallax,
                            double max_chi2) {
  std::vector<std::optional<frame::BundledPoint>> points;
  for (const auto& group : matched) points.push_back(triangulate_group(rig, cameras, group, min_parallax, max_chi2));
  std::vector<std::size_t> counts;
  for (const frame::CameraFrame& c : cameras) counts.push_back(c.keypoints.size());
  return frame::Bundled(counts, matched, points);
}

frame::BundledFrame bundle(const camera::Rig& rig, const frame::BundledFrame& extracted,
                           std::span<const image::Pyramid> pyramids, const BundlingOptions& options,
                           std::span<const AlignmentOptions> alignment, ThreadPool& pool) {
  const std::span<const frame::CameraFrame> detected = extracted.cameras;
  std::vector<CameraPair> pairs = overlapping_pairs(rig);
  std::erase_if(pairs, [&](const CameraPair& p) { return !frame::can_be_compared(extracted, p.a, p.b); });
  std::vector<std::vector<Edge>> found(pairs.size());
  pool.for_each(pairs.size(),
                [&](std::size_t p) { found[p] = match_pair(rig, detected, pyramids, pairs[p], options, alignment); });
  std::vector<Edge> edges;
  for (const auto& list : found) edges.insert(edges.end(), list.begin(), list.end());
  std::stable_sort(edges.begin(), edges.end(), [](const Edge& p, const Edge& q) { return p.hamming < q.hamming; });

  Grouping grouping(detected);
  AlignedPositions positions(detected);
  for (const Edge& e : edges) {
    if (grouping.join(e.a, e.b)) positions.align(e, pyramids, alignment);
  }
  std::vector<std::vector<frame::KeypointRef>> kept;
  for (std::vector<frame::KeypointRef>& group : grouping.take()) {
    if (keep_agreeing(rig, positions, options.max_chi2, group)) kept.push_back(std::move(group));
  }
  std::vector<feature::Refinement> refinements = std::move(positions).of_groups(kept);
  std::sort(kept.begin(), kept.end());

  frame::BundledFrame out = extracted;
  for (std::size_t c = 0; c < out.cameras.size(); ++c) {
    out.cameras[c] = frame::refined(out.cameras[c], std::move(refinements[c]), rig.camera(c));
  }
  out.bundled = make_bundled(rig, out.cameras, kept, options.min_parallax, options.max_chi2);
  return out;
}

}  // namespace bslam::matching
