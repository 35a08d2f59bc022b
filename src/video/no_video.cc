// Instead of video_file.cc where the headers of FFmpeg were not there.
#include "video/video_file.h"

namespace bslam::video {

Result<std::unique_ptr<VideoFile>> VideoFile::open(const std::filesystem::path& path) {
  return Error{path.string(), "", "a video", "a program that was built with FFmpeg",
               path.string() + ": this program was built without FFmpeg and cannot read videos"};
}

std::string ffmpeg_version() { return ""; }

}  // namespace bslam::video
