#include "camera/model_parameters.h"

#include <algorithm>
#include <cmath>

#include "camera/model_table.h"

namespace bslam::camera {
namespace {

constexpr Eigen::Index kFocalAndCentre = 4;  // fx fy cx cy
constexpr double kMinFocal = 1.0;            // px

const ModelRow& row_of(const CameraModel& model) { return model_table()[model.index()]; }

double clamped(double value, const ModelParameter& parameter) {
  constexpr double kInside = 1e-9;
  const double low = parameter.low_is_excluded ? parameter.low + kInside : parameter.low;
  return std::min(std::max(value, low), parameter.high);
}

}  // namespace

ModelParameters parameters(const CameraModel& model) {
  const Intrinsics& k = intrinsics(model);
  const std::vector<double> further = distortion(model);
  ModelParameters out(kFocalAndCentre + static_cast<Eigen::Index>(further.size()));
  out.head<kFocalAndCentre>() << k.fx, k.fy, k.cx, k.cy;
  for (std::size_t i = 0; i < further.size(); ++i) out(kFocalAndCentre + static_cast<Eigen::Index>(i)) = further[i];
  return out;
}

std::vector<std::string> parameter_names(const CameraModel& model) {
  std::vector<std::string> out = {"fx", "fy", "cx", "cy"};
  const std::size_t count = distortion(model).size();
  for (std::size_t i = 0; i < count; ++i) out.emplace_back(row_of(model).parameters[i].name);
  return out;
}

ModelParameters typical_sigmas(const CameraModel& model, double focal, double centre) {
  ModelParameters out = parameters(model);
  out.head<2>() *= focal;
  out.segment<2>(2).setConstant(centre);
  for (Eigen::Index i = kFocalAndCentre; i < out.size(); ++i)
    out(i) = row_of(model).parameters[static_cast<std::size_t>(i - kFocalAndCentre)].sigma;
  return out;
}

CameraModel with_parameters(const CameraModel& model, const ModelParameters& parameters) {
  const ModelRow& row = row_of(model);
  std::vector<double> further;
  for (Eigen::Index i = kFocalAndCentre; i < parameters.size(); ++i) {
    further.push_back(clamped(parameters(i), row.parameters[static_cast<std::size_t>(i - kFocalAndCentre)]));
  }
  return row.make(
      {std::max(parameters(0), kMinFocal), std::max(parameters(1), kMinFocal), parameters(2), parameters(3)}, further);
}

ParameterJacobian parameter_jacobian(const CameraModel& model, const Vector3d& point) {
  return std::visit(
      [&](const auto& m) {
        const auto further = static_cast<Eigen::Index>(m.num_distortion());
        ParameterJacobian out = ParameterJacobian::Zero(2, kFocalAndCentre + further);
        const auto pixel = m.project(point);
        if (!pixel) return out;
        const Intrinsics& k = m.intrinsics();
        out.template leftCols<kFocalAndCentre>() << (pixel->x() - k.cx) / k.fx, 0, 1, 0, 0, (pixel->y() - k.cy) / k.fy,
            0, 1;
        m.distortion_jacobian(point, out.rightCols(further));
        out.rightCols(further).row(0) *= k.fx;
        out.rightCols(further).row(1) *= k.fy;
        return out;
      },
      model);
}

}  // namespace bslam::camera
