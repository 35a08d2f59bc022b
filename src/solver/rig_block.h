// Parameters of the rig in bundle adjustment. A block type defines unknowns that all poses share, the derivatives of
// pixels with respect to them, and their prior. The assembly of the normal equations uses this interface only.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "camera/model_parameters.h"
#include "solver/reprojection.h"

namespace bslam::solver {

// Values of the parameters.
struct RigValues {
  std::vector<SE3> T_cam_rig;  // per camera
  std::vector<camera::CameraModel> models;
  std::vector<camera::CameraTiming> timing;

  static RigValues of(const Rig& rig);
  // Returns `rig` with these values. The timing is relative to the capture times of `rig`. The rig frame of the values
  // must be the frame of camera 0, which keeps its pose in the body.
  Rig applied_to(const Rig& rig) const;
};

// An observation at the values of the linearisation.
struct RigObservation {
  int camera = 0;
  const RigValues& values;    // the extrinsics do not include the motion from the time of the pose to that of the image
  const Vector3d& point_cam;  // metres, when the row of the pixel was exposed
  const Matrix23d& J;         // d pixel / d point_cam, divided by sigma
  const Vector3d& velocity;   // d point_cam / d time, m/s; zero if it is not known
  double relative_row;        // row of the pixel: -1/2 for the first row, 1/2 for the last
  double inverse_sigma;       // 1 / px
};

class RigBlock {
 public:
  using Jacobian = Eigen::Matrix<double, 2, Eigen::Dynamic, Eigen::RowMajor>;
  struct Range {
    int first = 0, size = 0;
  };

  virtual ~RigBlock() = default;
  virtual int size() const = 0;  // number of unknowns
  // The range of its unknowns that affect the pixels of a camera.
  virtual Range columns(int camera) const = 0;
  // Derivatives of the pixel with respect to those unknowns, divided by sigma: (2, columns(camera).size).
  virtual void evaluate(const RigObservation& observation, Eigen::Ref<Jacobian> J) const = 0;
  virtual void apply(const Eigen::VectorXd& delta, RigValues& values) const = 0;
  // Cost of the prior, half the squared normalised deviation from it, and its normal equations. The default is no
  // prior.
  virtual double prior_cost(const RigValues&) const { return 0.0; }
  virtual void add_prior(const RigValues&, Eigen::Ref<Eigen::MatrixXd>, Eigen::Ref<Eigen::VectorXd>) const {}
};

// Blocks of one adjustment. If they are applied, each must change different values.
using RigBlocks = std::vector<std::unique_ptr<RigBlock>>;

// Prior for the extrinsics of all cameras but the first: normal distributions around the calibrated values, and one of
// the common scale of all baselines (baseline_scale). Images do not determine this scale, so that it needs a separate
// prior, however uncertain the extrinsics are.
struct ExtrinsicPrior {
  std::vector<SE3> T_cam_rig;                        // calibrated, per camera
  double sigma_rotation = 0, sigma_translation = 0;  // radians, metres; per axis
  // Metres, additionally along the optical axes of the camera and of camera 0: to a calibration, an error of the focal
  // length looks like a displacement along the axis.
  double sigma_depth = 0;
  double sigma_scale = 0;  // relative standard deviation of the scale; 0: no separate prior
  // The number of cameras, the first ones, that are at their calibrated positions; 0: all. The others are cameras after
  // a move (SharedUnknowns): they may be anywhere near, so that each is taken as displaced.
  std::size_t with_baseline = 0;
  // Per camera: its position is far from the calibrated one. Its translation gets ten times the deviation, and its
  // baseline does not count for the scale. Empty: none.
  std::vector<std::uint8_t> displaced = {};
};

// Covariance of extrinsic_change() of a camera by the prior.
geometry::Matrix6d covariance_of(const ExtrinsicPrior& prior, std::size_t camera);

// Weights w_c of the baselines in their common scale, the inverse variance of the calibrated position c' of a camera in
// the rig frame along the direction of c', divided by sum w_c |c'|^2. 0: camera 0, cameras that are displaced or were
// moved, and cameras closer than a micrometre to the centre of camera 0. Thereby a baseline along an optical axis
// counts less.
std::vector<double> baseline_weights(const ExtrinsicPrior& prior);

// The common scale of the baselines relative to that of the calibration, the root of sum w_c |c|^2 with the estimated
// camera centres c in the rig frame: this depends on the lengths of the baselines only, not on their directions. 1 if
// all weights are 0.
double baseline_scale(std::span<const SE3> T_cam_rig, std::span<const double> weights);

// Flags the cameras whose centres are farther than four standard deviations from the calibrated ones, at the scale that
// half of the baselines do not exceed: with a mean, one camera that was displaced would spoil the scale of all. At
// least three baselines are needed, and more than half of the cameras are not displaced. Cameras behind `with_baseline`
// have no flag.
std::vector<std::uint8_t> displaced_cameras(std::span<const SE3> T_cam_rig, const ExtrinsicPrior& prior);

// Difference of extrinsics to a reference: for D = T_cam_rig reference^-1, the logarithm of the rotation (radians),
// then the translation (metres), both in the axes of the camera. The length of the translation is the distance by which
// the camera's centre moved.
geometry::Vector6d extrinsic_change(const SE3& T_cam_rig, const SE3& reference);

// The extrinsics of cameras 1 to N-1: left perturbations of T_cam_rig, rotation first.
class ExtrinsicsBlock : public RigBlock {
 public:
  explicit ExtrinsicsBlock(ExtrinsicPrior prior);

  int size() const override { return 6 * (static_cast<int>(prior_.T_cam_rig.size()) - 1); }
  Range columns(int camera) const override { return camera == 0 ? Range{} : Range{6 * (camera - 1), 6}; }
  void evaluate(const RigObservation& observation, Eigen::Ref<Jacobian> J) const override;
  void apply(const Eigen::VectorXd& delta, RigValues& values) const override;
  double prior_cost(const RigValues& values) const override;
  void add_prior(const RigValues& values, Eigen::Ref<Eigen::MatrixXd> H, Eigen::Ref<Eigen::VectorXd> b) const override;

 private:
  double scale_error(const RigValues& values) const;  // divided by its standard deviation

  ExtrinsicPrior prior_;
  std::vector<geometry::Matrix6d> information_;  // per camera: the inverse of covariance_of()
  std::vector<double> baseline_weights_;         // of the common scale; empty without a prior of it
};

// Which cameras have the same intrinsics and timing. If a camera is moved during a recording, the adjustment treats its
// images after the move as those of a further camera, behind the cameras of the rig: it has a pose of its own, but is
// the same device. Entry c is the index of the camera whose intrinsics and timing camera c has: c itself for a camera
// of the rig, and for a further camera the one that was moved. Empty: every camera has its own.
using SharedUnknowns = std::vector<std::size_t>;
inline bool has_own_unknowns(const SharedUnknowns& shared, std::size_t camera) {
  return shared.empty() || shared[camera] == camera;
}

// Prior for the intrinsics: normal distributions around the calibrated values, and one of the ratio fx / fy, which is
// known better than either.
struct IntrinsicPrior {
  std::vector<camera::ModelParameters> values, sigmas;  // per camera; the sigmas must be positive
  double sigma_aspect = 0;                              // relative standard deviation of fx / fy; 0: no separate prior
  SharedUnknowns shared = {};
};

// The parameters of the camera models of all cameras (camera/model_parameters.h), relative to their standard deviations
// in the prior, so that all unknowns have the same order of magnitude.
class IntrinsicsBlock : public RigBlock {
 public:
  explicit IntrinsicsBlock(IntrinsicPrior prior);

  int size() const override { return size_; }
  Range columns(int camera) const override { return columns_[static_cast<std::size_t>(camera)]; }
  void evaluate(const RigObservation& observation, Eigen::Ref<Jacobian> J) const override;
  void apply(const Eigen::VectorXd& delta, RigValues& values) const override;
  double prior_cost(const RigValues& values) const override;
  void add_prior(const RigValues& values, Eigen::Ref<Eigen::MatrixXd> H, Eigen::Ref<Eigen::VectorXd> b) const override;
  // Differences to the prior's values in standard deviations, of all cameras with own unknowns one after the other.
  Eigen::VectorXd normalised_change(const RigValues& values) const;

 private:
  // Derivative of the error of a camera's fx / fy, divided by its standard deviation, with respect to the first two
  // unknowns of the camera.
  Vector2d aspect_gradient(std::size_t camera) const;

  IntrinsicPrior prior_;
  std::vector<Range> columns_;  // per camera
  int size_ = 0;
};

// Prior for the timing of a camera: normal distributions around the calibrated values, in seconds. A value with the
// standard deviation 0 is constant.
struct TimingPrior {
  camera::CameraTiming mean;
  double sigma_shift = 0, sigma_readout = 0;
};

// The times at which the rows of each camera are exposed, relative to their standard deviations in the prior. The
// shift of camera 0 should be constant, because a common shift of all cameras changes nothing but the poses.
class TimingBlock : public RigBlock {
 public:
  explicit TimingBlock(std::vector<TimingPrior> prior, const SharedUnknowns& shared = {});

  int size() const override { return size_; }
  Range columns(int camera) const override { return columns_[static_cast<std::size_t>(camera)]; }
  void evaluate(const RigObservation& observation, Eigen::Ref<Jacobian> J) const override;
  void apply(const Eigen::VectorXd& delta, RigValues& values) const override;
  double prior_cost(const RigValues& values) const override;
  void add_prior(const RigValues& values, Eigen::Ref<Eigen::MatrixXd> H, Eigen::Ref<Eigen::VectorXd> b) const override;
  // Differences to the prior's values in standard deviations, of all cameras with own unknowns one after the other,
  // shift before readout.
  Eigen::VectorXd normalised_change(const RigValues& values) const;

 private:
  std::vector<TimingPrior> prior_;
  std::vector<Range> columns_;  // per camera
  int size_ = 0;
};

// A common scale factor of the translations of all extrinsics, as its relative change.
class BaselineScaleBlock : public RigBlock {
 public:
  int size() const override { return 1; }
  Range columns(int camera) const override { return {0, camera == 0 ? 0 : 1}; }
  void evaluate(const RigObservation& observation, Eigen::Ref<Jacobian> J) const override;
  void apply(const Eigen::VectorXd& delta, RigValues& values) const override;
};

}  // namespace bslam::solver
