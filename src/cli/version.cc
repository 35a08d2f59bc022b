#include "cli/version.h"

#include <fmt/format.h>
#include <libdeflate.h>
#include <lz4.h>
#include <png.h>
#include <sqlite3.h>
#include <zstd.h>

#include <CLI/Version.hpp>
#include <Eigen/Core>
#include <nlohmann/json.hpp>
#include <opencv2/core/version.hpp>

#include "video/video_file.h"

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
  text += fmt::format("OpenCV {}\nlibpng {}\n", CV_VERSION, PNG_LIBPNG_VER_STRING);
  text += fmt::format("yaml-cpp {}\n", BSLAM_YAML_CPP_VERSION);
#ifdef BSLAM_SIMULATOR
  text += fmt::format("Embree {}\n", BSLAM_EMBREE_VERSION);
#endif
  text += fmt::format("nlohmann-json {}.{}.{}\n", NLOHMANN_JSON_VERSION_MAJOR, NLOHMANN_JSON_VERSION_MINOR,
                      NLOHMANN_JSON_VERSION_PATCH);
  text += fmt::format("fmt {}.{}.{}\n", FMT_VERSION / 10000, FMT_VERSION / 100 % 100, FMT_VERSION % 100);
  text += fmt::format("CLI11 {}\n", CLI11_VERSION);
  text += fmt::format("libdeflate {}\nLZ4 {}\nzstd {}\nSQLite {}\n", LIBDEFLATE_VERSION_STRING, LZ4_VERSION_STRING,
                      ZSTD_VERSION_STRING, SQLITE_VERSION);
  text += fmt::format("OctoMap {}\n", BSLAM_OCTOMAP_VERSION);
  const std::string ffmpeg = video::ffmpeg_version();
  return text + (ffmpeg.empty() ? "without FFmpeg" : "libavformat " + ffmpeg);
}

}  // namespace bslam::cli
