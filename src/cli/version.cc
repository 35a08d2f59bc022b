#include "cli/version.h"

#include <fmt/format.h>

#include <CLI/Version.hpp>
#include <Eigen/Core>
#include <nlohmann/json.hpp>
#include <opencv2/core/version.hpp>

// The build system defines these; a build outside of it knows neither.
#ifndef BSLAM_VERSION
#define BSLAM_VERSION "0.1.0"
#endif
#ifndef BSLAM_GIT_REVISION
#define BSLAM_GIT_REVISION "unknown"
#endif

namespace bslam::cli {
namespace {

std::string compiler() {
#if defined(__clang__)
  return fmt::format("clang {}.{}.{}", __clang_major__, __clang_minor__, __clang_patchlevel__);
#elif defined(__GNUC__)
  return fmt::format("gcc {}.{}.{}", __GNUC__, __GNUC_MINOR__, __GNUC_PATCHLEVEL__);
#else
  return "unknown";
#endif
}

}  // namespace

std::string version_number() { return BSLAM_VERSION; }

std::string version_text() {
  std::string text =
      fmt::format("bslam {}\nrevision {}\ncompiler {}\n", version_number(), BSLAM_GIT_REVISION, compiler());
  text += fmt::format("Eigen {}.{}.{}\n", EIGEN_WORLD_VERSION, EIGEN_MAJOR_VERSION, EIGEN_MINOR_VERSION);
  text += fmt::format("OpenCV {}\n", CV_VERSION);
#ifdef BSLAM_YAML_CPP_VERSION  // its headers do not tell
  text += fmt::format("yaml-cpp {}\n", BSLAM_YAML_CPP_VERSION);
#endif
#ifdef BSLAM_EMBREE_VERSION
  text += fmt::format("Embree {}\n", BSLAM_EMBREE_VERSION);
#endif
  text += fmt::format("nlohmann-json {}.{}.{}\n", NLOHMANN_JSON_VERSION_MAJOR, NLOHMANN_JSON_VERSION_MINOR,
                      NLOHMANN_JSON_VERSION_PATCH);
  text += fmt::format("fmt {}.{}.{}\n", FMT_VERSION / 10000, FMT_VERSION / 100 % 100, FMT_VERSION % 100);
  return text + fmt::format("CLI11 {}", CLI11_VERSION);
}

}  // namespace bslam::cli
