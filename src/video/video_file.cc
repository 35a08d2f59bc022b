#include "video/video_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <deque>
#include <limits>
#include <mutex>
#include <optional>
#include <system_error>
#include <utility>

#include "base/max_image_side.h"
#include "video/ffmpeg.h"

namespace bslam::video {
namespace {

// Maximum memory of the images decoded last, which are kept because several threads read ahead; at least one is kept.
constexpr std::size_t kCachedImages = 24, kCachedBytes = std::size_t{1} << 26;
// Number of images; for larger distances seeking is faster than decoding all images in between.
constexpr std::size_t kFarAhead = 200;

// Everything of one open file; released in the order FFmpeg needs.
class Decoder {
 public:
  explicit Decoder(const Ffmpeg& f) : f_(f), packet_(f.av_packet_alloc()), frame_(f.av_frame_alloc()) {}
  ~Decoder() {
    f_.av_packet_free(&packet_);
    f_.av_frame_free(&frame_);
    f_.avcodec_free_context(&codec_);
    f_.sws_freeContext(scaler_);
    f_.avformat_close_input(&format_);
  }
  Decoder(const Decoder&) = delete;
  Decoder& operator=(const Decoder&) = delete;

  // Returns a description of the problem; empty if there is none.
  std::string open(const std::string& path);
  // Returns the presentation time of the next packet of the video, without decoding it; nullopt at the end. Packets
  // that an edit list hides are skipped, since the decoder does not return their images.
  std::optional<std::int64_t> next_time();
  // Continues at or before a time, or at the beginning.
  bool seek(std::int64_t time) {
    ended_ = damaged_ = false;
    f_.avcodec_flush_buffers(codec_);
    return f_.av_seek_frame(format_, stream_, time, AVSEEK_FLAG_BACKWARD) >= 0;
  }
  // Decodes the next image and returns its time; nullopt at the end or after a permanent error.
  std::optional<std::int64_t> next_image();
  void send_packet();
  // The image that was decoded last; nullopt if it is damaged or its size is impossible.
  std::optional<VideoImage> grey();

  TimeNs nanoseconds(std::int64_t time) const {
    return f_.av_rescale_q(time, format_->streams[stream_]->time_base, AVRational{1, 1'000'000'000});
  }
  const AVCodecParameters& parameters() const { return *format_->streams[stream_]->codecpar; }
  std::string codec_name() const { return codec_->codec->name; }

 private:
  const Ffmpeg& f_;
  AVPacket* packet_;
  AVFrame* frame_;
  AVFormatContext* format_ = nullptr;
  AVCodecContext* codec_ = nullptr;
  SwsContext* scaler_ = nullptr;
  // Images after a damaged one are built on it, up to the next that is complete by itself.
  void note_damage() {
#if LIBAVUTIL_VERSION_INT >= AV_VERSION_INT(58, 29, 100)
    const bool complete = (frame_->flags & AV_FRAME_FLAG_KEY) != 0;
#else
    const bool complete = frame_->key_frame != 0;
#endif
    // The decoder fills what it cannot decode with other parts of the video, and says so.
    const bool wrong = (frame_->flags & AV_FRAME_FLAG_CORRUPT) != 0 || frame_->decode_error_flags != 0;
    damaged_ = wrong || (damaged_ && !complete);
  }

  int stream_ = -1;
  bool ended_ = false;
  bool damaged_ = false;
};

std::string Decoder::open(const std::string& path) {
  if (packet_ == nullptr || frame_ == nullptr) return "no memory";
  // The protocol is named, since a path may look like an address.
  const std::string url = "file:" + path;
  const auto reason = [this](int error) {
    char text[AV_ERROR_MAX_STRING_SIZE] = {};
    return f_.av_strerror(error, text, sizeof(text)) < 0 ? std::string() : fmt::format(" ({})", text);
  };
  if (const int error = f_.avformat_open_input(&format_, url.c_str(), nullptr, nullptr); error < 0)
    return "a file that is no bag, and no video that FFmpeg can read" + reason(error);
  if (const int error = f_.avformat_find_stream_info(format_, nullptr); error < 0)
    return "a video without readable streams" + reason(error);
  const AVCodec* codec = nullptr;
  stream_ = f_.av_find_best_stream(format_, AVMEDIA_TYPE_VIDEO, -1, -1, &codec, 0);
  if (stream_ < 0 || codec == nullptr) return "no video stream with a supported codec";
  codec_ = f_.avcodec_alloc_context3(codec);
  if (codec_ == nullptr || f_.avcodec_parameters_to_context(codec_, &parameters()) < 0) return "no memory";
  codec_->thread_count = 2;
  codec_->err_recognition = AV_EF_CRCCHECK | AV_EF_BITSTREAM;
  if (const int error = f_.avcodec_open2(codec_, codec, nullptr); error < 0)
    return "a codec that cannot be opened" + reason(error);
  for (unsigned k = 0; k < format_->nb_streams; ++k)
    format_->streams[k]->discard = static_cast<int>(k) == stream_ ? AVDISCARD_DEFAULT : AVDISCARD_ALL;
  return "";
}

std::optional<std::int64_t> Decoder::next_time() {
  while (f_.av_read_frame(format_, packet_) >= 0) {
    const bool ours = packet_->stream_index == stream_ && (packet_->flags & AV_PKT_FLAG_DISCARD) == 0;
    const std::int64_t time = packet_->pts != AV_NOPTS_VALUE ? packet_->pts : packet_->dts;
    f_.av_packet_unref(packet_);
    if (ours) return time;
  }
  return std::nullopt;
}

// Gives the decoder the next packet of the video, or the end.
void Decoder::send_packet() {
  constexpr int kTries = 100;
  int status = 0;
  while ((status = f_.av_read_frame(format_, packet_)) >= 0 && packet_->stream_index != stream_)
    f_.av_packet_unref(packet_);
  ended_ = status < 0;
  int sent = AVERROR(EAGAIN);
  // After an error the decoder may first have to output its remaining images, which are damaged.
  for (int k = 0; k < kTries && sent == AVERROR(EAGAIN); ++k) {
    sent = f_.avcodec_send_packet(codec_, ended_ ? nullptr : packet_);
    if (sent != AVERROR(EAGAIN)) break;
    f_.avcodec_receive_frame(codec_, frame_);
  }
  if (sent < 0 && sent != AVERROR_EOF) damaged_ = true;
  f_.av_packet_unref(packet_);
}

std::optional<std::int64_t> Decoder::next_image() {
  for (;;) {
    f_.av_frame_unref(frame_);
    const int got = f_.avcodec_receive_frame(codec_, frame_);
    if (got == 0) {
      note_damage();
      return frame_->best_effort_timestamp;
    }
    if (got == AVERROR_EOF || ended_) return std::nullopt;
    if (got != AVERROR(EAGAIN)) damaged_ = true;  // else more input is wanted
    send_packet();
  }
}

std::optional<VideoImage> Decoder::grey() {
  if (damaged_ || frame_->width < 1 || frame_->height < 1 || frame_->width > kMaxImageSidePx ||
      frame_->height > kMaxImageSidePx)
    return std::nullopt;
  scaler_ =
      f_.sws_getCachedContext(scaler_, frame_->width, frame_->height, static_cast<AVPixelFormat>(frame_->format),
                              frame_->width, frame_->height, AV_PIX_FMT_GRAY8, SWS_POINT, nullptr, nullptr, nullptr);
  if (scaler_ == nullptr) return std::nullopt;
  VideoImage image{"", frame_->width, frame_->height};
  // Its vector code may write up to the next multiple of its width.
  constexpr std::size_t kAlignment = 64;
  const auto width = static_cast<std::size_t>(image.width), height = static_cast<std::size_t>(image.height);
  const std::size_t step = (width + kAlignment - 1) / kAlignment * kAlignment;
  std::string rows(step * height + kAlignment, '\0');
  std::uint8_t* const to[4] = {reinterpret_cast<std::uint8_t*>(rows.data()), nullptr, nullptr, nullptr};
  const int steps[4] = {static_cast<int>(step), 0, 0, 0};
  if (f_.sws_scale(scaler_, frame_->data, frame_->linesize, 0, frame_->height, to, steps) != frame_->height)
    return std::nullopt;
  for (std::size_t y = 0; y < height; ++y) image.grey.append(rows, y * step, width);
  return image;
}

class FfmpegVideo : public VideoFile {
 public:
  FfmpegVideo(std::filesystem::path path, const Ffmpeg& f) : path_(std::move(path)), decoder_(f) {}

  Status prepare();

  int width() const override { return decoder_.parameters().width; }
  int height() const override { return decoder_.parameters().height; }
  std::string codec() const override { return decoder_.codec_name(); }
  const std::vector<TimeNs>& times() const override { return times_; }
  const std::vector<std::string>& warnings() const override { return warnings_; }
  Result<VideoImage> read(std::size_t index) override;

 private:
  // The number of the image that is shown at a time.
  std::optional<std::size_t> index_of(std::int64_t time) const {
    const auto after = std::ranges::lower_bound(stamps_, time);
    if (after == stamps_.end() || *after != time) return std::nullopt;
    return static_cast<std::size_t>(after - stamps_.begin());
  }
  bool decode_up_to(std::size_t index);
  void keep(std::size_t index, VideoImage image);
  Error damaged_image(std::size_t index) const {
    return {path_.string(), fmt::format("image {}", index), "an image that cannot be decoded", "a complete image"};
  }

  std::filesystem::path path_;
  std::mutex mutex_;
  Decoder decoder_;
  std::vector<std::int64_t> stamps_;  // in units of the file, increasing
  std::vector<TimeNs> times_;
  std::vector<std::string> warnings_;
  std::vector<bool> damaged_;  // images that could not be decoded
  bool after_seek_ = false;    // nothing was decoded since then
  std::size_t next_ = 0;       // number of the image after the one that was decoded last
  std::deque<std::pair<std::size_t, VideoImage>> cache_;
};

Status FfmpegVideo::prepare() {
  if (const std::string wrong = decoder_.open(path_.string()); !wrong.empty())
    return Error{path_.string(), "", wrong, "a ROS bag (.bag, .db3, .mcap), a video, or the folder of a data set"};
  std::size_t untimed = 0;
  while (const auto time = decoder_.next_time()) {
    if (*time == AV_NOPTS_VALUE)
      ++untimed;
    else
      stamps_.push_back(*time);
  }
  std::ranges::sort(stamps_);
  const auto repeated = std::unique(stamps_.begin(), stamps_.end());
  untimed += static_cast<std::size_t>(stamps_.end() - repeated);
  stamps_.erase(repeated, stamps_.end());
  if (untimed > 0)
    warnings_.push_back(fmt::format("{}: {} images without a time of their own are not used", path_.string(), untimed));
  if (stamps_.empty()) return Error{path_.string(), "", "no images with times", "a video"};
  const TimeNs first = decoder_.nanoseconds(stamps_.front());
  for (const std::int64_t time : stamps_) times_.push_back(decoder_.nanoseconds(time) - first);
  damaged_.assign(stamps_.size(), false);
  if (!decoder_.seek(stamps_.front()))
    return Error{path_.string(), "", "a video that cannot be read again from the start", "a file"};
  return {};
}

// Decodes images into the cache until the image `index` was passed. Returns false at the end of the file.
bool FfmpegVideo::decode_up_to(std::size_t index) {
  while (next_ <= index) {
    const auto time = decoder_.next_image();
    if (!time) return false;
    const auto number = index_of(*time);
    if (!number) continue;
    for (std::size_t k = next_; !after_seek_ && k < *number; ++k) damaged_[k] = true;
    after_seek_ = false;
    next_ = *number + 1;
    auto image = decoder_.grey();
    damaged_[*number] = !image.has_value();
    if (!image) continue;
    keep(*number, *std::move(image));
  }
  return true;
}

// Adds an image to the cache, from which the oldest ones are removed.
void FfmpegVideo::keep(std::size_t index, VideoImage image) {
  cache_.emplace_back(index, std::move(image));
  std::size_t bytes = 0;
  for (const auto& [other, cached] : cache_) bytes += cached.grey.size();
  while (cache_.size() > 1 && (cache_.size() > kCachedImages || bytes > kCachedBytes)) {
    bytes -= cache_.front().second.grey.size();
    cache_.pop_front();
  }
}

Result<VideoImage> FfmpegVideo::read(std::size_t index) {
  const std::lock_guard lock(mutex_);
  const auto cached = [&] { return std::ranges::find(cache_, index, &std::pair<std::size_t, VideoImage>::first); };
  if (const auto found = cached(); found != cache_.end()) return found->second;
  if (index < next_ || index > next_ + kFarAhead) {
    cache_.clear();
    if (damaged_.at(index)) return damaged_image(index);
    decoder_.seek(stamps_.at(index));
    after_seek_ = true;
    next_ = 0;
  }
  decode_up_to(index);
  if (const auto found = cached(); found != cache_.end()) return found->second;
  return damaged_image(index);
}

}  // namespace

Result<std::unique_ptr<VideoFile>> VideoFile::open(const std::filesystem::path& path) {
  const auto ffmpeg = load_ffmpeg();
  if (!ffmpeg) return ffmpeg.error();
  auto video = std::make_unique<FfmpegVideo>(path, **ffmpeg);
  if (const Status s = video->prepare(); !s) return s.error();
  return std::unique_ptr<VideoFile>(std::move(video));
}

std::string ffmpeg_version() { return fmt::format("{}.{}", LIBAVFORMAT_VERSION_MAJOR, LIBAVFORMAT_VERSION_MINOR); }

}  // namespace bslam::video
