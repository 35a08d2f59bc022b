// The functions of FFmpeg that are used, from its shared libraries. Internal to this folder.
#pragma once

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/avutil.h>
#include <libswscale/swscale.h>
}

#include "base/result.h"

namespace bslam::video {

#define BSLAM_AVFORMAT_FUNCTIONS(F) \
  F(avformat_open_input)            \
  F(avformat_find_stream_info)      \
  F(avformat_close_input)           \
  F(av_find_best_stream)            \
  F(av_read_frame)                  \
  F(av_seek_frame)
#define BSLAM_AVCODEC_FUNCTIONS(F) \
  F(avcodec_alloc_context3)        \
  F(avcodec_free_context)          \
  F(avcodec_parameters_to_context) \
  F(avcodec_open2)                 \
  F(avcodec_send_packet)           \
  F(avcodec_receive_frame)         \
  F(avcodec_flush_buffers)         \
  F(av_packet_alloc)               \
  F(av_packet_free)                \
  F(av_packet_unref)
#define BSLAM_AVUTIL_FUNCTIONS(F) \
  F(av_frame_alloc)               \
  F(av_frame_free)                \
  F(av_frame_unref)               \
  F(av_rescale_q)                 \
  F(av_strerror)                  \
  F(av_log_set_level)
#define BSLAM_SWSCALE_FUNCTIONS(F) \
  F(sws_getCachedContext)          \
  F(sws_scale)                     \
  F(sws_freeContext)

// One pointer per function, of its type.
struct Ffmpeg {
#define BSLAM_MEMBER(name) decltype(&::name) name = nullptr;
  BSLAM_AVFORMAT_FUNCTIONS(BSLAM_MEMBER)
  BSLAM_AVCODEC_FUNCTIONS(BSLAM_MEMBER)
  BSLAM_AVUTIL_FUNCTIONS(BSLAM_MEMBER)
  BSLAM_SWSCALE_FUNCTIONS(BSLAM_MEMBER)
#undef BSLAM_MEMBER
};

// Loads the libraries of the version of the headers, once. Errors: they are not installed, or lack a function.
Result<const Ffmpeg*> load_ffmpeg();

}  // namespace bslam::video
