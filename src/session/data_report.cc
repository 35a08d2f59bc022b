#include "session/data_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "base/exact_seconds.h"
#include "base/median.h"
#include "dataset/recording_description.h"
#include "dataset/time_stamps.h"

namespace bslam::session {
namespace {

using dataset::RecordingDescription;
using dataset::StreamDescription;
using Json = nlohmann::ordered_json;

// Images or messages per second; 0 if unknown, also if the times of images are hardly in nanoseconds. Gaps do not
// change it, where all times are known.
double rate_hz(const StreamDescription& stream) {
  const std::vector<TimeNs>& t = stream.times;
  if (t.size() < 2 || t.back() <= t.front() || (stream.camera >= 0 && !dataset::are_nanoseconds(t))) return 0;
  if (t.size() == 2) return static_cast<double>(stream.count - 1) / to_seconds(t.back() - t.front());
  std::vector<TimeNs> intervals;
  for (std::size_t k = 1; k < t.size(); ++k) intervals.push_back(t[k] - t[k - 1]);
  const TimeNs middle = median(std::move(intervals));
  return middle > 0 ? 1e9 / static_cast<double>(middle) : 0;
}

TimeNs longest_gap(const StreamDescription& stream) {
  TimeNs longest = 0;
  for (std::size_t k = 1; k < stream.times.size(); ++k)
    longest = std::max(longest, stream.times[k] - stream.times[k - 1]);
  return longest;
}

struct Span {
  TimeNs first_ns = 0, last_ns = 0;
};

// Of the images if there are any, else of all messages.
Span span_of(const RecordingDescription& recording) {
  std::optional<Span> span;
  for (const bool images : {true, false}) {
    for (const StreamDescription& stream : recording.streams) {
      if (stream.times.empty() || (images && stream.width == 0)) continue;
      if (!span) span = Span{stream.times.front(), stream.times.back()};
      span->first_ns = std::min(span->first_ns, stream.times.front());
      span->last_ns = std::max(span->last_ns, stream.times.back());
    }
    if (span) return *span;
  }
  return {};
}

std::string size_text(const StreamDescription& stream) {
  return stream.width > 0 ? fmt::format("{}x{}", stream.width, stream.height) : "-";
}

std::string stamps_text(const StreamDescription& stream) {
  if (!stream.lag) return stream.stamps;
  constexpr double kNothing_s = 5e-5;
  if (std::abs(stream.lag->least) < kNothing_s && std::abs(stream.lag->most) < kNothing_s)
    return stream.stamps + ", as of recording";
  return fmt::format("{}; recorded {:.1f} ms later ({:.1f} to {:.1f})", stream.stamps, 1e3 * stream.lag->median,
                     1e3 * stream.lag->least, 1e3 * stream.lag->most);
}

std::string table(const RecordingDescription& recording, const Span& span) {
  std::vector<std::array<std::string, 10>> rows = {
      {"camera", "from", "type", "count", "size", "encoding", "rate", "first", "last", "stamps"}};
  for (const StreamDescription& s : recording.streams) {
    const double rate = rate_hz(s);
    const auto seconds = [&](TimeNs time_ns) { return fmt::format("{:.3f} s", to_seconds(time_ns - span.first_ns)); };
    rows.push_back({s.camera >= 0 ? std::to_string(s.camera) : "-", s.name, s.type, std::to_string(s.count),
                    size_text(s), s.encoding, rate > 0 ? fmt::format("{:.1f} Hz", rate) : "-",
                    s.times.empty() ? "-" : seconds(s.times.front()), s.times.empty() ? "-" : seconds(s.times.back()),
                    s.times.empty() ? "-" : stamps_text(s)});
  }
  std::array<std::size_t, 10> widths{};
  for (const auto& row : rows) {
    for (std::size_t c = 0; c < row.size(); ++c) widths[c] = std::max(widths[c], row[c].size());
  }
  std::string text;
  for (const auto& row : rows) {
    std::string line;
    for (std::size_t c = 0; c < row.size(); ++c) line += fmt::format("{:<{}}  ", row[c], widths[c]);
    line.erase(line.find_last_not_of(' ') + 1);
    text += line + "\n";
  }
  return text;
}

std::string used_text(const RecordingDescription& recording) {
  std::vector<std::string> cameras;
  for (const StreamDescription& s : recording.streams) {
    if (s.camera < 0) continue;
    cameras.resize(std::max<std::size_t>(cameras.size(), static_cast<std::size_t>(s.camera) + 1));
    cameras[static_cast<std::size_t>(s.camera)] = s.name;
  }
  std::string text = "used by bslam run:";
  for (std::size_t c = 0; c < cameras.size(); ++c)
    text += fmt::format("{} {} as camera {}", c == 0 ? "" : ",", cameras[c], c);
  return cameras.empty() ? "used by bslam run: nothing\n" : text + "\n";
}

std::string as_text(const std::string& path, const RecordingDescription& recording) {
  const Span span = span_of(recording);
  std::string text = fmt::format("{}: {}, {:.3f} s from {} s\n", path, recording.format,
                                 to_seconds(span.last_ns - span.first_ns), exact_seconds(span.first_ns)) +
                     table(recording, span);
  for (const StreamDescription& s : recording.streams) {
    if (!s.unused.empty()) text += fmt::format("not used: {}: {}\n", s.name, s.unused);
    for (const std::string& note : s.notes) text += fmt::format("note: {}: {}\n", s.name, note);
    const double rate = rate_hz(s);
    if (s.camera >= 0 && rate > 0 && to_seconds(longest_gap(s)) > 3 / rate)
      text += fmt::format("note: {}: longest gap between images {:.3f} s\n", s.name, to_seconds(longest_gap(s)));
  }
  for (const auto& s : recording.synchrony) {
    text += s.together == s.images
                ? fmt::format("camera {} is synchronous with camera 0\n", s.camera)
                : fmt::format(
                      "camera {}: {} of {} images have one of camera 0 at the same time; the nearest is {:.1f} ms "
                      "away (median)\n",
                      s.camera, s.together, s.images, s.median_ms);
  }
  text += used_text(recording);
  for (const std::string& missing : recording.missing) text += "missing for bslam run: " + missing + "\n";
  for (const std::string& warning : recording.warnings) text += "warning: " + warning + "\n";
  if (!recording.refusal.empty() && std::ranges::count(recording.missing, recording.refusal) == 0)
    text += "refused by bslam run: " + recording.refusal + "\n";
  return text;
}

Json stream_json(const StreamDescription& s) {
  Json lag;
  if (s.lag) lag = {{"min_s", s.lag->least}, {"median_s", s.lag->median}, {"max_s", s.lag->most}};
  return {{"name", s.name},
          {"type", s.type},
          {"camera", s.camera >= 0 ? Json(s.camera) : Json()},
          {"count", s.count},
          {"resolution", s.width > 0 ? Json({s.width, s.height}) : Json()},
          {"encoding", s.encoding},
          {"rate_hz", rate_hz(s)},
          {"first_ns", s.times.empty() ? Json() : Json(s.times.front())},
          {"last_ns", s.times.empty() ? Json() : Json(s.times.back())},
          {"stamps", s.stamps},
          {"recorded_after_stamp", std::move(lag)},
          {"calibrated", s.calibrated},
          {"not_used", s.unused.empty() ? Json() : Json(s.unused)},
          {"notes", s.notes}};
}

std::string as_json(const std::string& path, const RecordingDescription& recording) {
  const Span span = span_of(recording);
  Json streams = Json::array(), synchrony = Json::array();
  for (const StreamDescription& s : recording.streams) streams.push_back(stream_json(s));
  for (const auto& s : recording.synchrony) {
    synchrony.push_back(
        {{"camera", s.camera}, {"images", s.images}, {"with_camera_0", s.together}, {"median_ms", s.median_ms}});
  }
  const Json json = {{"schema", 1},
                     {"data", path},
                     {"format", recording.format},
                     {"first_ns", span.first_ns},
                     {"duration_s", to_seconds(span.last_ns - span.first_ns)},
                     {"streams", std::move(streams)},
                     {"synchrony", std::move(synchrony)},
                     {"missing", recording.missing},
                     {"refused", recording.refusal.empty() ? Json() : Json(recording.refusal)},
                     {"warnings", recording.warnings}};
  return json.dump(1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

}  // namespace

Result<DataReport> report_data(const dataset::DatasetRequest& request, bool json) {
  const auto recording = dataset::describe_recording(request);
  if (!recording) return recording.error();
  const std::string path = request.path.string();
  return DataReport{json ? as_json(path, *recording) : as_text(path, *recording),
                    recording->refusal.empty() || recording->only_uncalibrated};
}

}  // namespace bslam::session
