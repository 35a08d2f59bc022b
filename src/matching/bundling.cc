#include "matching/bundling.h"

#include <algorithm>
#include <numeric>

#include "matching/epipolar_search.h"
#include "matching/point_estimation.h"

namespace bslam::matching {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// A match of keypoints of two cameras, with the second one's aligned place.
struct Edge {
  frame::KeypointRef a, b;
  int hamming = 0;
  AlignedKeypoint aligned;
  Vector3d bearing;  // of the aligned pixel
};

struct CameraPair {
  CameraIndex a, b;
};

std::vector<CameraPair> overlapping_pairs(const camera::Rig& rig) {
  std::vector<CameraPair> pairs;
  for (std::size_t i = 0; i < rig.size(); ++i) {
    for (std::size_t j = i + 1; j < rig.size(); ++j) {
      if (rig.overlap(i, j) || rig.overlap(j, i)) pairs.push_back({CameraIndex(i), CameraIndex(j)});
    }
  }
  return pairs;
}

PointObservation observation(const camera::Rig& rig, std::span<const frame::CameraFrame> cameras,
                             frame::KeypointRef ref) {
  const feature::Keypoints& k = cameras[ref.camera.index()].keypoints;
  const std::size_t i = ref.keypoint.index();
  return {&rig.camera(ref.camera), rig.cam_from_rig(ref.camera), k.pixel[i].cast<double>(), k.bearing[i], k.sigma[i]};
}

// Places keypoint b where the patch of keypoint a is seen. Empty where it does not look alike there.
bool align_edge(const camera::Rig& rig, std::span<const frame::CameraFrame> cameras,
                std::span<const image::Pyramid> pyramids, std::span<const AlignmentOptions> alignment, Edge& edge) {
  const feature::Keypoints& ka = cameras[edge.a.camera.index()].keypoints;
  const feature::Keypoints& kb = cameras[edge.b.camera.index()].keypoints;
  const std::size_t ia = edge.a.keypoint.index(), ib = edge.b.keypoint.index();
  const geometry::SE3 T_b_a = rig.cam_from_rig(edge.b.camera) * rig.rig_from_cam(edge.a.camera.index());
  const std::array<PointObservation, 2> pair = {observation(rig, cameras, edge.a), observation(rig, cameras, edge.b)};
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
  const EpipolarView a{
      &rig.camera(pair.a), &cameras[pair.a.index()].keypoints, rig.rig_from_cam(pair.a.index()), {}, 0, 0};
  const EpipolarView b{
      &rig.camera(pair.b), &cameras[pair.b.index()].keypoints, rig.rig_from_cam(pair.b.index()), {}, 0, 0};
  const EpipolarOptions search{.min_depth_m = options.min_depth_m,
                               .sigmas = options.sigmas,
                               .max_hamming = options.max_hamming,
                               .ratio = options.ratio,
                               .max_level_difference = 2};
  std::vector<Edge> edges;
  for (const EpipolarMatch& m : match_epipolar(a, b, search)) {
    Edge edge{{pair.a, m.a}, {pair.b, m.b}, m.hamming, {}, {}};
    if (align_edge(rig, cameras, pyramids, alignment, edge)) edges.push_back(edge);
  }
  return edges;
}

// Groups of keypoints joined by edges, the strongest first; an edge that would bring two keypoints of one camera
// together is left out.
class Grouping {
 public:
  explicit Grouping(std::span<const frame::CameraFrame> cameras) {
    begin_.push_back(0);
    for (const frame::CameraFrame& c : cameras) begin_.push_back(begin_.back() + c.keypoints.size());
    group_of_.assign(begin_.back(), -1);
  }

  bool join(frame::KeypointRef a, frame::KeypointRef b) {
    int& ga = group_of_[slot(a)];
    int& gb = group_of_[slot(b)];
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
    for (const frame::KeypointRef r : merged) group_of_[slot(r)] = target;
    groups_[static_cast<std::size_t>(target)] = std::move(merged);
    return true;
  }

  std::vector<std::vector<frame::KeypointRef>> take() {
    std::erase_if(groups_, [](const auto& g) { return g.size() < 2; });
    return std::move(groups_);
  }

 private:
  std::size_t slot(frame::KeypointRef r) const { return begin_[r.camera.index()] + r.keypoint.index(); }
  std::vector<frame::KeypointRef> members(int group, frame::KeypointRef self) const {
    return group < 0 ? std::vector<frame::KeypointRef>{self} : groups_[static_cast<std::size_t>(group)];
  }
  std::vector<std::size_t> begin_;
  std::vector<int> group_of_;
  std::vector<std::vector<frame::KeypointRef>> groups_;
};

// Keypoints as aligned to one another, and the way back for those that turn out to belong to nothing.
class Placement {
 public:
  explicit Placement(std::span<frame::CameraFrame> cameras) : cameras_(cameras) {
    for (const frame::CameraFrame& c : cameras) state_.emplace_back(c.keypoints.size(), kAsDetected);
  }

  // Moves the second keypoint of an edge to where the patch of the first is seen; the first defines the feature, so its
  // own place is exact. An edge whose first keypoint was moved itself would lead to where that no longer is.
  void apply(const Edge& edge, std::span<const image::Pyramid> pyramids, std::span<const AlignmentOptions> alignment) {
    if (state(edge.a) == kMoved || state(edge.b) != kAsDetected) return;
    feature::Keypoints& ka = cameras_[edge.a.camera.index()].keypoints;
    feature::Keypoints& kb = cameras_[edge.b.camera.index()].keypoints;
    const std::size_t ia = edge.a.keypoint.index(), ib = edge.b.keypoint.index();
    if (state(edge.a) == kAsDetected) remember(edge.a);
    remember(edge.b);
    state(edge.a) = kReference;
    state(edge.b) = kMoved;
    const double scale_a = pyramids[edge.a.camera.index()].scale_x[ka.level[ia]];
    ka.sigma[ia] = std::min(ka.sigma[ia], static_cast<float>(alignment[edge.a.camera.index()].sigma(0.0, scale_a)));
    kb.pixel[ib] = edge.aligned.pixel.cast<float>();
    kb.bearing[ib] = edge.bearing;
    kb.sigma[ib] = static_cast<float>(edge.aligned.sigma);
  }

  void restore_all_but(std::span<const std::vector<frame::KeypointRef>> groups) {
    for (const auto& group : groups) {
      for (const frame::KeypointRef r : group) state(r) = kAsDetected;  // nothing to restore
    }
    for (const Before& b : before_) {
      if (state(b.ref) == kAsDetected) continue;
      feature::Keypoints& k = cameras_[b.ref.camera.index()].keypoints;
      const std::size_t i = b.ref.keypoint.index();
      k.pixel[i] = b.pixel;
      k.bearing[i] = b.bearing;
      k.sigma[i] = b.sigma;
    }
  }

 private:
  enum State : std::uint8_t { kAsDetected, kReference, kMoved };
  struct Before {
    frame::KeypointRef ref;
    Eigen::Vector2f pixel;
    Vector3d bearing;
    float sigma;
  };
  std::uint8_t& state(frame::KeypointRef r) { return state_[r.camera.index()][r.keypoint.index()]; }
  void remember(frame::KeypointRef r) {
    const feature::Keypoints& k = cameras_[r.camera.index()].keypoints;
    const std::size_t i = r.keypoint.index();
    before_.push_back({r, k.pixel[i], k.bearing[i], k.sigma[i]});
  }
  std::span<frame::CameraFrame> cameras_;
  std::vector<std::vector<std::uint8_t>> state_;
  std::vector<Before> before_;
};

// All keypoints of the group look the same way, as far as their noise tells: a feature too far for a point.
bool agrees_at_infinity(const camera::Rig& rig, std::span<const frame::CameraFrame> cameras, double max_chi2,
                        std::span<const frame::KeypointRef> group) {
  constexpr double kFar_m = 1e5;
  const PointObservation first = observation(rig, cameras, group.front());
  const Vector3d point_rig = rig.rig_from_cam(group.front().camera.index()) * (kFar_m * first.bearing);
  return std::all_of(group.begin() + 1, group.end(), [&](frame::KeypointRef ref) {
    const PointObservation o = observation(rig, cameras, ref);
    const auto pixel = o.camera->project(o.T_cam_common * point_rig);
    return pixel && (*pixel - o.pixel).squaredNorm() <= max_chi2 * (o.sigma * o.sigma + first.sigma * first.sigma);
  });
}

// Keypoints that do not meet in one point are no feature: the worst goes until the rest agrees. False where less than
// two are left.
bool keep_agreeing(const camera::Rig& rig, std::span<const frame::CameraFrame> cameras, double max_chi2,
                   std::vector<frame::KeypointRef>& group) {
  while (group.size() >= 2) {
    std::vector<PointObservation> observations;
    for (const frame::KeypointRef ref : group) observations.push_back(observation(rig, cameras, ref));
    const auto estimated = estimate_point(observations, 0.0);
    if (!estimated) return agrees_at_infinity(rig, cameras, max_chi2, group);  // rays that diverge by their noise
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
  for (const frame::KeypointRef ref : group) observations.push_back(observation(rig, cameras, ref));
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

frame::Bundled bundle(const camera::Rig& rig, std::span<frame::CameraFrame> cameras,
                      std::span<const image::Pyramid> pyramids, const BundlingOptions& options,
                      std::span<const AlignmentOptions> alignment, ThreadPool& pool) {
  const std::vector<CameraPair> pairs = overlapping_pairs(rig);
  std::vector<std::vector<Edge>> found(pairs.size());
  pool.for_each(pairs.size(),
                [&](std::size_t p) { found[p] = match_pair(rig, cameras, pyramids, pairs[p], options, alignment); });
  std::vector<Edge> edges;
  for (const auto& list : found) edges.insert(edges.end(), list.begin(), list.end());
  std::stable_sort(edges.begin(), edges.end(), [](const Edge& p, const Edge& q) { return p.hamming < q.hamming; });

  Grouping grouping(cameras);
  Placement placement(cameras);
  for (const Edge& e : edges) {
    if (grouping.join(e.a, e.b)) placement.apply(e, pyramids, alignment);
  }
  std::vector<std::vector<frame::KeypointRef>> kept;
  for (std::vector<frame::KeypointRef>& group : grouping.take()) {
    if (keep_agreeing(rig, cameras, options.max_chi2, group)) kept.push_back(std::move(group));
  }
  placement.restore_all_but(kept);
  std::sort(kept.begin(), kept.end());
  return make_bundled(rig, cameras, kept, options.min_parallax, options.max_chi2);
}

}  // namespace bslam::matching
