#include "image_files/image_folder.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <span>
#include <string_view>
#include <system_error>

#include "base/atomic_file.h"
#include "base/exact_seconds.h"
#include "base/lower_case.h"
#include "base/median.h"
#include "base/number_text.h"

namespace bslam::image_files {
namespace {

namespace fs = std::filesystem;

// The extensions of the images that can be decoded.
constexpr std::array<std::string_view, 3> kPngOrJpeg = {".png", ".jpg", ".jpeg"};
constexpr std::array<std::string_view, 7> kOthers = {".webp", ".pgm", ".ppm", ".pnm", ".bmp", ".tif", ".tiff"};

std::string images_text(std::size_t count) { return fmt::format("{} image{}", count, count == 1 ? "" : "s"); }

// A stamp of 0 is damaged if it follows others, or is as far from them as no pause of a recording is.
std::size_t remove_damaged_zeros(std::vector<ImageFile>& images) {
  constexpr TimeNs kPause = 20, kLongestPause = 1000;  // intervals between images
  std::vector<TimeNs> others;
  bool follows = false;
  std::size_t zeros = 0;
  for (const ImageFile& image : images) {
    zeros += image.time_ns == 0;
    follows |= image.time_ns == 0 && !others.empty();
    if (image.time_ns != 0) others.push_back(image.time_ns);
  }
  if (zeros == 0 || others.size() < 2) return 0;
  std::ranges::sort(others);
  const TimeNs duration = others.back() - others.front();
  const TimeNs interval = std::max<TimeNs>(1, duration / (std::ssize(others) - 1));
  const bool far = others.front() > duration && others.front() / kLongestPause > interval;
  if (!(follows ? others.front() / kPause > interval : far)) return 0;
  std::erase_if(images, [](const ImageFile& image) { return image.time_ns == 0; });
  return zeros;
}

// Returns true if the clock was set back between `before` and `after`, two ascending runs of time stamps: there are
// images more often at the times of both runs than at the times of one.
bool is_set_back(std::span<const TimeNs> before, std::span<const TimeNs> after) {
  constexpr std::ptrdiff_t kEnough = 3;  // images of each run at the times of both, and intervals at other times
  constexpr double kDenser = 0.75;       // half the interval for runs of the same rate
  const TimeNs from = std::max(before.front(), after.front()), to = std::min(before.back(), after.back());
  const auto is_inside = [&](TimeNs time) { return time >= from && time <= to; };
  if (std::ranges::count_if(before, is_inside) < kEnough || std::ranges::count_if(after, is_inside) < kEnough)
    return false;
  std::vector<TimeNs> all, outside;
  std::ranges::merge(before, after, std::back_inserter(all));
  for (std::size_t k = 1; k < all.size(); ++k) {
    if (all[k] <= from || all[k - 1] >= to) outside.push_back(all[k] - all[k - 1]);
  }
  if (std::ssize(outside) < kEnough) return false;
  const double interval =
      static_cast<double>(to - from) / static_cast<double>(std::ranges::count_if(all, is_inside) - 1);
  return interval < kDenser * static_cast<double>(median(outside));
}

// If the clock was set back during a recording, images after that have times of images before, but show other moments,
// and sorting would mix the two. Removes those after and returns their number.
std::size_t remove_times_after_set_back(std::vector<ImageFile>& images) {
  std::vector<TimeNs> times;
  std::ranges::transform(images, std::back_inserter(times), &ImageFile::time_ns);
  std::size_t first_after = 0;  // behind the largest step
  TimeNs largest = 0;
  for (std::size_t k = 1; k < times.size(); ++k) {
    if (times[k - 1] - times[k] <= largest) continue;
    first_after = k;
    largest = times[k - 1] - times[k];
  }
  if (first_after == 0) return 0;
  const auto before = std::span(times).first(first_after), after = std::span(times).subspan(first_after);
  std::ranges::sort(before);
  std::ranges::sort(after);
  if (!is_set_back(before, after)) return 0;
  const auto begin = images.begin() + static_cast<std::ptrdiff_t>(first_after);
  const auto kept = std::remove_if(begin, images.end(), [&](const ImageFile& image) {
    return image.time_ns >= before.front() && image.time_ns <= before.back();
  });
  const auto count = static_cast<std::size_t>(images.end() - kept);
  images.erase(kept, images.end());
  return count;
}

// Returns a text with the number of backward steps of time stamps and the first of them; empty if there are none.
std::string steps_back_text(const std::vector<ImageFile>& images, StampUnit unit) {
  std::size_t steps = 0, first = 0;
  for (std::size_t k = 1; k < images.size(); ++k) {
    if (images[k].time_ns < images[k - 1].time_ns && steps++ == 0) first = k;
  }
  if (steps == 0) return {};
  const auto stamp = [unit](TimeNs time_ns) {
    return unit == StampUnit::kSeconds ? exact_seconds(time_ns) + " s" : std::to_string(time_ns);
  };
  return fmt::format("time stamps step back {} time{}, first from {} to {}; images have been sorted", steps,
                     steps == 1 ? "" : "s", stamp(images[first - 1].time_ns), stamp(images[first].time_ns));
}

}  // namespace

bool is_image_name(const fs::path& file) {
  return is_png_or_jpeg_name(file) ||
         std::ranges::find(kOthers, lower_case(file.extension().string())) != kOthers.end();
}

bool is_png_or_jpeg_name(const fs::path& file) {
  return std::ranges::find(kPngOrJpeg, lower_case(file.extension().string())) != kPngOrJpeg.end();
}

std::string name_of(const ImageFile& image) {
  return image.store ? image.store->name(image.entry) : image.path.string();
}

std::string source_of(const ImageFile& image) {
  return image.store ? image.store->source(image.entry) : image.path.parent_path().string();
}

ImageList in_time_order(std::vector<ImageFile> images, const std::string& source, StampUnit unit) {
  ImageList list;
  if (const std::size_t damaged = remove_damaged_zeros(images); damaged > 0) {
    list.warnings.push_back(fmt::format("{}: {} {} the damaged time stamp 0 and {} not used", source,
                                        images_text(damaged), damaged == 1 ? "has" : "have",
                                        damaged == 1 ? "is" : "are"));
  }
  while (const std::size_t removed = remove_times_after_set_back(images)) {
    list.warnings.push_back(
        fmt::format("{}: the clock was set back during the recording; {} with times that had been before {} not used",
                    source, images_text(removed), removed == 1 ? "is" : "are"));
  }
  if (std::string text = steps_back_text(images, unit); !text.empty()) {
    list.warnings.push_back(fmt::format("{}: {}", source, text));
    list.sorted = true;
    std::ranges::stable_sort(images, {}, &ImageFile::time_ns);
  }
  const auto last = std::unique(images.begin(), images.end(),
                                [](const ImageFile& a, const ImageFile& b) { return a.time_ns == b.time_ns; });
  if (last != images.end()) {
    list.warnings.push_back(
        fmt::format("{}: {} images with the time stamp of another image are not used", source, images.end() - last));
    images.erase(last, images.end());
  }
  list.images = std::move(images);
  return list;
}

std::vector<NumberedImage> images_in(const fs::path& folder) {
  std::vector<NumberedImage> images;
  std::error_code error;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    const std::string stem = it->path().stem().string();
    if (!is_png_or_jpeg_name(it->path()) || stem.find_first_not_of("0123456789") != std::string::npos) continue;
    if (const auto number = parse_integer(stem)) images.push_back({*number, it->path()});
  }
  std::sort(images.begin(), images.end(), [](const NumberedImage& a, const NumberedImage& b) {
    return a.number != b.number ? a.number < b.number : a.path < b.path;
  });
  return images;
}

std::optional<ImageSize> first_image_size(const std::vector<NumberedImage>& images) {
  constexpr std::size_t kTries = 5, kMaxImageBytes = std::size_t{1} << 30;
  for (std::size_t i = 0; i < std::min(kTries, images.size()); ++i) {
    const auto bytes = read_file(images[i].path, kMaxImageBytes);
    const auto size = bytes ? image_size(*bytes) : std::nullopt;
    if (size) return size;
  }
  return std::nullopt;
}

}  // namespace bslam::image_files
