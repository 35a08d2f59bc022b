#include "camera/model_table.h"

#include <algorithm>
#include <limits>

namespace bslam::camera {
namespace {

constexpr double kInf = std::numeric_limits<double>::infinity();

constexpr double kSigmaShape = 0.01;         // radial coefficients and shape parameters
constexpr double kSigmaTangential = 0.0005;  // p1, p2

ModelParameter coefficient(std::string_view name) {
  return {name, name.front() == 'p' ? kSigmaTangential : kSigmaShape, -kInf, kInf};
}

ModelRow pinhole() {
  return {Pinhole::kName, {}, {0}, [](const Intrinsics& k, const auto&) -> CameraModel { return Pinhole(k); }};
}

ModelRow pinhole_radtan() {
  std::vector<ModelParameter> parameters;
  for (const char* name : {"k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"}) parameters.push_back(coefficient(name));
  return {
      PinholeRadTan::kName, std::move(parameters), {4, 5, 8}, [](const Intrinsics& k, const auto& p) -> CameraModel {
        return PinholeRadTan(k, p);
      }};
}

ModelRow kannala_brandt() {
  return {KannalaBrandt::kName,
          {coefficient("k1"), coefficient("k2"), coefficient("k3"), coefficient("k4")},
          {4},
          [](const Intrinsics& k, const auto& p) -> CameraModel {
            return KannalaBrandt(k, {p[0], p[1], p[2], p[3]});
          }};
}

ModelRow unified() {
  return {Unified::kName, {{"alpha", kSigmaShape, 0, 1}}, {1}, [](const Intrinsics& k, const auto& p) -> CameraModel {
            return Unified(k, p[0]);
          }};
}

ModelRow extended_unified() {
  return {ExtendedUnified::kName,
          {{"alpha", kSigmaShape, 0, 1}, {"beta", kSigmaShape, 0, 1e6, true}},
          {2},
          [](const Intrinsics& k, const auto& p) -> CameraModel { return ExtendedUnified(k, p[0], p[1]); }};
}

ModelRow double_sphere() {
  return {DoubleSphere::kName,
          {{"xi", kSigmaShape, -1, 1, true}, {"alpha", kSigmaShape, 0, 1}},
          {2},
          [](const Intrinsics& k, const auto& p) -> CameraModel { return DoubleSphere(k, p[0], p[1]); }};
}

// A smaller w is a pinhole to all digits; tan(w / 2) is infinite at pi.
ModelRow fov() {
  return {Fov::kName, {{"w", kSigmaShape, 1e-6, 3.14}}, {1}, [](const Intrinsics& k, const auto& p) -> CameraModel {
            return Fov(k, p[0]);
          }};
}

}  // namespace

bool ModelRow::takes(std::size_t count) const { return std::ranges::find(counts, count) != counts.end(); }

const std::vector<ModelRow>& model_table() {
  static const std::vector<ModelRow> table = {
      pinhole(), pinhole_radtan(), kannala_brandt(), unified(), extended_unified(), double_sphere(), fov()};
  return table;
}

const ModelRow* find_model(std::string_view name) {
  const auto& table = model_table();
  const auto row = std::ranges::find(table, name, &ModelRow::name);
  return row == table.end() ? nullptr : &*row;
}

std::vector<std::string_view> model_names() {
  std::vector<std::string_view> names;
  for (const ModelRow& row : model_table()) names.push_back(row.name);
  return names;
}

}  // namespace bslam::camera
