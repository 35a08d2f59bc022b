// The parameters of a camera model as a vector, for their estimation: fx fy cx cy, then distortion or shape parameters
// in the order of rig files (camera/model_table.h).
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "camera/camera_model.h"

namespace bslam::camera {

constexpr int kMaxModelParameters = 12;
using ModelParameters = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxModelParameters, 1>;
using ParameterJacobian = Eigen::Matrix<double, 2, Eigen::Dynamic, 0, 2, kMaxModelParameters>;

ModelParameters parameters(const CameraModel& model);
// Names as in the documentation of rig files: "fx", "fy", "cx", "cy", "k1" ...
std::vector<std::string> parameter_names(const CameraModel& model);
// Standard deviations of the parameters of a usual calibration: `focal` relative to the focal lengths, `centre` in
// pixels, and those of the model table for the others.
ModelParameters typical_sigmas(const CameraModel& model, double focal, double centre);
// A model of the same kind with other parameters. Parameters outside of their valid range are set to its bound; focal
// lengths to at least one pixel.
CameraModel with_parameters(const CameraModel& model, const ModelParameters& parameters);

// d pixel / d parameters, (2, number of parameters), for a point in the camera frame that the model projects. Zero if
// it does not.
ParameterJacobian parameter_jacobian(const CameraModel& model, const Vector3d& point);

}  // namespace bslam::camera
