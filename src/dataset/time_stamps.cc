#include "dataset/time_stamps.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "image/frame_grouping.h"

namespace bslam::dataset {
namespace {

TimeNs median_interval(const std::vector<image_files::ImageFile>& images) {
  std::vector<TimeNs> times;
  for (const image_files::ImageFile& image : images) times.push_back(image.time_ns);
  return image::median_interval(times);
}

// Returns the option that most likely makes sense of time stamps that differ by `interval` units.
std::string likely_option(TimeNs interval) {
  constexpr TimeNs kLargestStep = 10;   // between the numbers of consecutive images
  constexpr TimeNs kLongest_ms = 2000;  // at most this long in milliseconds, otherwise the unit is microseconds
  if (interval <= kLargestStep) return "--rate HZ if they are image numbers";
  return interval <= kLongest_ms ? "--stamp-unit ms if they are milliseconds"
                                 : "--stamp-unit us if they are microseconds";
}

Status check_nanoseconds(const std::string& source, const std::vector<image_files::ImageFile>& images) {
  if (images.size() < 2) return {};
  const TimeNs interval = median_interval(images);
  if (interval >= kShortestInterval) return {};
  const std::string rate = fmt::format("{:.0f}", 1e9 / static_cast<double>(std::max<TimeNs>(interval, 1)));
  return Error{
      source, "time stamps", fmt::format("images {} ns apart", interval), "--rate HZ or --stamp-unit UNIT",
      fmt::format("{}: time stamps {} apart would be {} images per second in nanoseconds; give {} (options: --rate "
                  "HZ, --stamp-unit ns|us|ms|s)",
                  source, interval, rate, likely_option(interval))};
}

// The option that makes sense of time stamps that differ by `interval` units, other than the one that was given.
std::string other_option(TimeNs interval) {
  return interval >= kShortestInterval ? "no --stamp-unit if they are nanoseconds" : likely_option(interval);
}

// Returns true if the unit is wrong, because the frame rate of the camera would be impossibly high or low.
Status check_unit(const TimeStampOptions& options, const std::string& source, TimeNs interval,
                  const std::vector<image_files::ImageFile>& images) {
  const bool as_they_are = options.unit_ns == TimeNs{1};
  if (images.size() < 2 || as_they_are) return {};
  const TimeNs converted_ns = median_interval(images);
  constexpr TimeNs kNumbers = 10;  // consecutive images have numbers that differ by no more
  const bool slow = converted_ns > kLongestInterval && (options.unit_ns || interval > kNumbers);
  if (converted_ns >= kShortestInterval && !slow) return {};
  const std::string rate = fmt::format("{:.3g}", 1e9 / static_cast<double>(std::max<TimeNs>(converted_ns, 1)));
  const char* const option = options.rate_hz ? "--rate" : "--stamp-unit";
  return Error{source, "time stamps", fmt::format("{} images per second", rate), "another " + std::string(option),
               fmt::format("{}: time stamps {} apart would be {} images per second with this {}; give {}", source,
                           interval, rate, option, other_option(interval))};
}

Status check_options(const TimeStampOptions& options) {
  if (options.rate_hz && options.unit_ns)
    return Error{"--rate", "", "--stamp-unit as well", "one of --rate and --stamp-unit"};
  if (options.rate_hz && !(*options.rate_hz >= 1e-3 && *options.rate_hz <= 1e6))
    return Error{"--rate", "", fmt::format("{:g}", *options.rate_hz), "images per second, from 0.001 to 1000000"};
  if (options.unit_ns && *options.unit_ns <= 0)
    return Error{"--stamp-unit", "", fmt::format("{} ns", *options.unit_ns), "a positive unit"};
  return {};
}

}  // namespace

bool are_nanoseconds(std::span<const TimeNs> stamps) {
  return stamps.size() < 2 || image::median_interval(stamps) >= kShortestInterval;
}

Status convert_time_stamps(const TimeStampOptions& options, const std::string& source,
                           std::vector<image_files::ImageFile>& images) {
  if (const Status status = check_options(options); !status) return status;
  if (!options.rate_hz && !options.unit_ns) return check_nanoseconds(source, images);
  const TimeNs interval = median_interval(images);
  const double unit_ns = options.rate_hz ? 1e9 / *options.rate_hz : static_cast<double>(*options.unit_ns);
  for (image_files::ImageFile& image : images) {
    const TimeNs stamp = image.time_ns;
    if (static_cast<double>(stamp) * unit_ns > static_cast<double>(kMaxTime)) {
      return Error{
          source, options.rate_hz ? "--rate" : "--stamp-unit",
          fmt::format("time stamp {}, which is too large for this {}", stamp, options.rate_hz ? "rate" : "unit"),
          options.rate_hz ? "numbers of images; time stamps in nanoseconds need no option"
                          : "time stamps in this unit; those in nanoseconds need no option"};
    }
    // Whole units are multiplied exactly; a frame rate rounds every time by itself, so that errors do not add up.
    image.time_ns = options.unit_ns ? stamp * *options.unit_ns : std::llround(static_cast<double>(stamp) * unit_ns);
  }
  return check_unit(options, source, interval, images);
}

}  // namespace bslam::dataset
