// Camera models: a closed set behind one interface. Points are in the camera frame (x right, y down, z forward) in
// metres. Pixels refer to the raw image, with (0, 0) at the centre of the top-left pixel. Each model has a
// domain and returns nullopt outside of it. `distortion_jacobian` computes the derivative of the point on the image
// plane (the pixel without focal lengths and principal point) with respect to the parameters of `distortion()`, one
// column each, for a point in the domain.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string_view>
#include <variant>
#include <vector>

namespace bslam::camera {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Matrix23d = Eigen::Matrix<double, 2, 3>;
using Matrix2Xd = Eigen::Matrix<double, 2, Eigen::Dynamic>;

struct Projection {
  Vector2d pixel;
  Matrix23d jacobian;  // d pixel / d point
};

// Focal lengths and principal point in pixels of the raw image.
struct Intrinsics {
  double fx = 0, fy = 0, cx = 0, cy = 0;
};

// Pinhole without distortion: domain z > 0.
class Pinhole {
 public:
  explicit Pinhole(const Intrinsics& k) : k_(k) {}
  std::optional<Vector2d> project(const Vector3d& point) const;
  std::optional<Projection> project_with_jacobian(const Vector3d& point) const;
  std::optional<Vector3d> unproject(const Vector2d& pixel) const;  // returns a unit vector
  const Intrinsics& intrinsics() const { return k_; }
  std::vector<double> distortion() const { return {}; }
  static constexpr int num_distortion() { return 0; }  // size of distortion()
  void distortion_jacobian(const Vector3d&, const Eigen::Ref<Matrix2Xd>&) const {}
  static constexpr std::string_view kName = "pinhole";

 private:
  Intrinsics k_;
};

// Pinhole with the radial-tangential (Brown-Conrady) distortion of OpenCV: k1 k2 p1 p2 [k3 [k4 k5 k6]]; with eight
// coefficients the radial factor is rational. Domain: z > 0, and a normalised radius below the first one at which the
// distorted radius stops increasing (beyond it two directions project to the same pixel).
class PinholeRadTan {
 public:
  // `distortion` has 4, 5 or 8 entries.
  PinholeRadTan(const Intrinsics& k, const std::vector<double>& distortion);
  std::optional<Vector2d> project(const Vector3d& point) const;
  std::optional<Projection> project_with_jacobian(const Vector3d& point) const;
  std::optional<Vector3d> unproject(const Vector2d& pixel) const;
  const Intrinsics& intrinsics() const { return k_; }
  std::vector<double> distortion() const { return {d_.begin(), d_.begin() + count_}; }
  int num_distortion() const { return count_; }  // size of distortion()
  void distortion_jacobian(const Vector3d& point, Eigen::Ref<Matrix2Xd> J) const;
  static constexpr std::string_view kName = "pinhole-radtan";

 private:
  struct Distorted {
    Vector2d point;
    Eigen::Matrix2d jacobian;
  };
  // The factor of the radius, and its derivative with respect to the squared radius r2.
  struct Radial {
    double factor, derivative;
  };
  Radial radial(double r2) const;
  Vector2d distorted(const Vector2d& m, double r2, const Radial& radial) const;
  Distorted distort(const Vector2d& m) const;

  Intrinsics k_;
  std::array<double, 8> d_{};  // k1 k2 p1 p2 k3 k4 k5 k6
  int count_ = 0;
  double max_radius_ = 0;  // tangent of the maximum valid angle, or infinity
};

// Kannala-Brandt fisheye (PAMI 2006; OpenCV's fisheye, Kalibr's equidistant): r = theta (1 + k1 theta^2 + ... k4
// theta^8). Domain: theta below the first angle at which r stops increasing, at most pi, so points with z <= 0 are
// included.
class KannalaBrandt {
 public:
  KannalaBrandt(const Intrinsics& k, const std::array<double, 4>& distortion);
  std::optional<Vector2d> project(const Vector3d& point) const;
  std::optional<Projection> project_with_jacobian(const Vector3d& point) const;
  std::optional<Vector3d> unproject(const Vector2d& pixel) const;
  const Intrinsics& intrinsics() const { return k_; }
  std::vector<double> distortion() const { return {d_.begin(), d_.end()}; }
  static constexpr int num_distortion() { return 4; }  // size of distortion()
  void distortion_jacobian(const Vector3d& point, Eigen::Ref<Matrix2Xd> J) const;
  static constexpr std::string_view kName = "kannala-brandt";

 private:
  Intrinsics k_;
  std::array<double, 4> d_{};
  double max_theta_ = 0, max_r_ = 0;  // radians
};

// Unified camera model (Geyer, Daniilidis 2000; Mei, Rives 2007; in the form of Usenko et al., 3DV 2018): a point is
// projected onto the unit sphere and from there, through a centre behind the sphere's centre, onto the plane: m = (x,
// y) / (alpha |p| + (1 - alpha) z) with alpha in [0, 1]. alpha = 0 is a pinhole; Mei's xi is alpha / (1 - alpha) and
// his focal length is f (1 + xi). Domain: where the projection is one-to-one (docs/math.md, section 8); for alpha > 0
// it includes points with z <= 0.
class Unified {
 public:
  Unified(const Intrinsics& k, double alpha);
  std::optional<Vector2d> project(const Vector3d& point) const;
  std::optional<Projection> project_with_jacobian(const Vector3d& point) const;
  std::optional<Vector3d> unproject(const Vector2d& pixel) const;
  const Intrinsics& intrinsics() const { return k_; }
  std::vector<double> distortion() const { return {alpha_}; }
  static constexpr int num_distortion() { return 1; }  // size of distortion()
  void distortion_jacobian(const Vector3d& point, Eigen::Ref<Matrix2Xd> J) const;
  static constexpr std::string_view kName = "ucm";

 private:
  Intrinsics k_;
  double alpha_ = 0;
};

// Extended unified camera model (Khomutenko, Garcia, Martinet, RA-L 2016): an ellipsoid replaces the sphere, m = (x, y)
// / (alpha sqrt(beta (x^2 + y^2) + z^2) + (1 - alpha) z) with alpha in [0, 1], beta > 0.
class ExtendedUnified {
 public:
  ExtendedUnified(const Intrinsics& k, double alpha, double beta);
  std::optional<Vector2d> project(const Vector3d& point) const;
  std::optional<Projection> project_with_jacobian(const Vector3d& point) const;
  std::optional<Vector3d> unproject(const Vector2d& pixel) const;
  const Intrinsics& intrinsics() const { return k_; }
  std::vector<double> distortion() const { return {alpha_, beta_}; }
  static constexpr int num_distortion() { return 2; }  // size of distortion()
  void distortion_jacobian(const Vector3d& point, Eigen::Ref<Matrix2Xd> J) const;
  static constexpr std::string_view kName = "eucm";

 private:
  Intrinsics k_;
  double alpha_ = 0, beta_ = 1;
};

// Double sphere model (Usenko, Demmel, Cremers, 3DV 2018): a point is projected onto two unit spheres whose centres are
// xi apart, then onto the plane as in the unified model. xi in (-1, 1], alpha in [0, 1]. The focal length on the
// optical axis is f / (1 + xi).
class DoubleSphere {
 public:
  DoubleSphere(const Intrinsics& k, double xi, double alpha);
  std::optional<Vector2d> project(const Vector3d& point) const;
  std::optional<Projection> project_with_jacobian(const Vector3d& point) const;
  std::optional<Vector3d> unproject(const Vector2d& pixel) const;
  const Intrinsics& intrinsics() const { return k_; }
  std::vector<double> distortion() const { return {xi_, alpha_}; }
  static constexpr int num_distortion() { return 2; }  // size of distortion()
  void distortion_jacobian(const Vector3d& point, Eigen::Ref<Matrix2Xd> J) const;
  static constexpr std::string_view kName = "double-sphere";

 private:
  Intrinsics k_;
  double xi_ = 0, alpha_ = 0;
};

// Field-of-view model (Devernay, Faugeras, MVA 2001): a pinhole whose normalised radius r becomes atan(2 r tan(w / 2))
// / w with w in (0, pi) radians. The radius 1/2 stays the same for every w, and the focal length on the optical axis is
// f 2 tan(w / 2) / w. Domain: z > 0, and pixels with a distorted radius below pi / (2 w).
class Fov {
 public:
  Fov(const Intrinsics& k, double w);
  std::optional<Vector2d> project(const Vector3d& point) const;
  std::optional<Projection> project_with_jacobian(const Vector3d& point) const;
  std::optional<Vector3d> unproject(const Vector2d& pixel) const;
  const Intrinsics& intrinsics() const { return k_; }
  std::vector<double> distortion() const { return {w_}; }
  static constexpr int num_distortion() { return 1; }  // size of distortion()
  void distortion_jacobian(const Vector3d& point, Eigen::Ref<Matrix2Xd> J) const;
  static constexpr std::string_view kName = "fov";

 private:
  double scale(double radius) const;  // distorted radius / radius

  Intrinsics k_;
  double w_ = 0, slope_ = 0;  // slope: 2 tan(w / 2)
};

using CameraModel = std::variant<Pinhole, PinholeRadTan, KannalaBrandt, Unified, ExtendedUnified, DoubleSphere, Fov>;

// Name of the model in rig files.
std::string_view model_name(const CameraModel& model);
const Intrinsics& intrinsics(const CameraModel& model);
// The parameters besides fx fy cx cy, in the order of rig files: distortion coefficients, or shape parameters of the
// sphere models.
std::vector<double> distortion(const CameraModel& model);

}  // namespace bslam::camera

#include "camera/pinhole_projection.h"
