#include "video/ffmpeg.h"

#include <dlfcn.h>
#include <fmt/format.h>

#include <string>

namespace bslam::video {
namespace {

struct Loaded {
  Ffmpeg functions;
  std::string missing;  // what could not be loaded
};

void* open_library(const char* name, int version, std::string& missing) {
  const std::string file = fmt::format("lib{}.so.{}", name, version);
  void* library = ::dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (library == nullptr && missing.empty()) missing = file;
  return library;
}

Loaded load() {
  Loaded out;
  Ffmpeg& f = out.functions;
  void* library = nullptr;
#define BSLAM_LOAD(name)                                                                        \
  if (library != nullptr) f.name = reinterpret_cast<decltype(f.name)>(::dlsym(library, #name)); \
  if (f.name == nullptr && out.missing.empty()) out.missing = #name;
  library = open_library("avutil", LIBAVUTIL_VERSION_MAJOR, out.missing);
  BSLAM_AVUTIL_FUNCTIONS(BSLAM_LOAD)
  library = open_library("swscale", LIBSWSCALE_VERSION_MAJOR, out.missing);
  BSLAM_SWSCALE_FUNCTIONS(BSLAM_LOAD)
  library = open_library("avcodec", LIBAVCODEC_VERSION_MAJOR, out.missing);
  BSLAM_AVCODEC_FUNCTIONS(BSLAM_LOAD)
  library = open_library("avformat", LIBAVFORMAT_VERSION_MAJOR, out.missing);
  BSLAM_AVFORMAT_FUNCTIONS(BSLAM_LOAD)
#undef BSLAM_LOAD
  if (out.missing.empty()) f.av_log_set_level(AV_LOG_QUIET);
  return out;
}

}  // namespace

Result<const Ffmpeg*> load_ffmpeg() {
  static const Loaded loaded = load();
  if (loaded.missing.empty()) return &loaded.functions;
  return Error{
      "", "", "no " + loaded.missing, "FFmpeg's libraries",
      "videos need FFmpeg, of which " + loaded.missing + " was not found (packages libavformat and libswscale)"};
}

}  // namespace bslam::video
