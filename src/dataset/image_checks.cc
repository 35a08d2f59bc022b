#include "dataset/image_checks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>
#include <string>
#include <system_error>
#include <unordered_map>
#include <unordered_set>

#include "image_decoding/image_file.h"

namespace bslam::dataset {
namespace {

using Images = std::vector<image_files::ImageFile>;

bool exists(const image_files::ImageFile& file) {
  std::error_code error;
  return file.store || std::filesystem::exists(file.path, error);
}

// The first images that exist, and then others spread over the list.
std::vector<const image_files::ImageFile*> samples_of(const Images& images) {
  constexpr std::size_t kTries = 5;
  std::vector<const image_files::ImageFile*> samples;
  for (std::size_t k = 0; k < images.size() && samples.size() < kTries; ++k) {
    if (exists(images[k])) samples.push_back(&images[k]);
  }
  for (std::size_t k = 1; k <= kTries && !samples.empty(); ++k) {
    const image_files::ImageFile* const image = &images[(images.size() - 1) * k / kTries];
    if (exists(*image) && std::ranges::find(samples, image) == samples.end()) samples.push_back(image);
  }
  return samples;
}

// Returns the 80 % quantile of the intervals: longer ones are gaps, and shorter ones occur where two series are mixed.
TimeNs usual_interval(std::vector<TimeNs> intervals) {
  const auto at = intervals.begin() + static_cast<std::ptrdiff_t>(intervals.size() * 4 / 5);
  std::ranges::nth_element(intervals, at);
  return *at;
}

bool is_flat(const image::Image& image) {
  for (int y = 0; y < image.height(); ++y) {
    if (!std::all_of(image.row(y), image.row(y) + image.width(), [&](auto v) { return v == *image.row(0); }))
      return false;
  }
  return true;
}

bool is_equal(const image::Image& a, const image::Image& b) {
  if (a.width() != b.width() || a.height() != b.height()) return false;
  for (int y = 0; y < a.height(); ++y) {
    if (!std::equal(a.row(y), a.row(y) + a.width(), b.row(y))) return false;
  }
  return true;
}

// The first images of a camera, decoded when they are needed; nullopt: cannot be read.
class FirstImages {
 public:
  explicit FirstImages(const Images& images) : images_(images) {}
  const std::optional<image::Image>& at(std::size_t k) {
    while (decoded_.size() <= k) {
      auto image = image_decoding::read_image(images_[decoded_.size()]);
      decoded_.push_back(image ? std::optional(*std::move(image)) : std::nullopt);
    }
    return decoded_[k];
  }
  std::size_t size() const { return images_.size(); }

 private:
  const Images& images_;
  std::vector<std::optional<image::Image>> decoded_;
};

bool have_same_images(FirstImages& a, FirstImages& b) {
  constexpr std::size_t kTries = 20, kEqual = 3;
  std::size_t equal = 0;
  for (std::size_t k = 0; k < std::min({kTries, a.size(), b.size()}) && equal < kEqual; ++k) {
    const std::optional<image::Image>&first = a.at(k), &second = b.at(k);
    if (!first || !second) continue;
    if (!is_equal(*first, *second)) return false;
    equal += !is_flat(*first);
  }
  return equal >= kEqual;
}

// Tells whether files exist; lists each folder once.
class FolderContents {
 public:
  bool has(const std::filesystem::path& file) {
    const std::string& name = file.native();
    const std::size_t begin = name.rfind('/') + 1;  // 0 if there is no folder
    const auto [found, is_new] = names_.try_emplace(name.substr(0, begin));
    if (is_new) found->second = names_in(file.parent_path());
    return found->second.contains(name.substr(begin));
  }

 private:
  static std::unordered_set<std::string> names_in(const std::filesystem::path& folder) {
    std::unordered_set<std::string> names;
    std::error_code error;
    for (std::filesystem::directory_iterator it(folder, error), end; !error && it != end; it.increment(error))
      names.insert(it->path().filename().string());
    return names;
  }

  std::unordered_map<std::string, std::unordered_set<std::string>> names_;
};

}  // namespace

void add_once(const std::string& warning, std::vector<std::string>& warnings) {
  if (std::ranges::find(warnings, warning) == warnings.end()) warnings.push_back(warning);
}

std::string resolution_hint(int width, int height, const camera::Camera& camera) {
  constexpr double kRounded = 1;  // pixels
  const double factor = static_cast<double>(width) / camera.width;
  if (width <= 0 || width == camera.width || std::abs(height - factor * camera.height) > kRounded) return {};
  const std::string part = factor == 0.5 ? "half" : factor == 2 ? "twice" : fmt::format("{:.3g} times", factor);
  return fmt::format("; it looks like images of {} the resolution, for which its intrinsics must be scaled", part);
}

std::optional<std::string> absent_warning(const Images& images) {
  FolderContents contents;
  std::size_t absent = 0;
  const image_files::ImageFile* first = nullptr;
  for (const image_files::ImageFile& image : images) {
    if (image.store || contents.has(image.path)) continue;
    if (absent++ == 0) first = &image;
  }
  if (absent == 0 || absent == images.size()) return std::nullopt;
  return fmt::format("{}: {} of {} listed images are not there, the first: {}", image_files::source_of(images.front()),
                     absent, images.size(), image_files::name_of(*first));
}

Status check_images(const Images& images, const camera::Camera& camera) {
  std::string found, hint;
  std::optional<Error> first_error;
  const std::vector<const image_files::ImageFile*> samples = samples_of(images);
  for (const image_files::ImageFile* file : samples) {
    const auto image = image_decoding::read_image(*file);
    if (!image && !first_error) first_error = image.error();
    if (!image) continue;
    if (image->width() == camera.width && image->height() == camera.height) return {};
    found = fmt::format("{}x{} pixels", image->width(), image->height());
    hint = resolution_hint(image->width(), image->height(), camera);
  }
  if (samples.empty()) {
    return Error{image_files::name_of(images.front()), camera.name,
                 fmt::format("no such file, as for all {} listed images", images.size()), "at least one image"};
  }
  if (found.empty()) {
    return Error{first_error->file, camera.name, first_error->found,
                 fmt::format("an image that can be read: none of {} that were tried can be", samples.size())};
  }
  return Error{image_files::source_of(images.front()), camera.name, "images of " + found,
               fmt::format("{}x{}, the resolution of the calibration{}", camera.width, camera.height, hint)};
}

Status check_different_images(const std::vector<Images>& images) {
  std::vector<FirstImages> first;
  for (const Images& of_camera : images) first.emplace_back(of_camera);
  for (std::size_t c = 1; c < images.size(); ++c) {
    for (std::size_t other = 0; other < c; ++other) {
      if (!have_same_images(first[c], first[other])) continue;
      return Error{image_files::source_of(images[c].front()), "",
                   "the same images as in " + image_files::source_of(images[other].front()), "images of each camera"};
    }
  }
  return {};
}

std::optional<std::string> interleaved_warning(const Images& images) {
  // Minimum number of successive alternating intervals, and of usual intervals elsewhere.
  constexpr std::size_t kLeast = 10;
  if (images.size() < 2 * kLeast) return std::nullopt;
  std::vector<TimeNs> intervals;
  for (std::size_t k = 1; k < images.size(); ++k) intervals.push_back(images[k].time_ns - images[k - 1].time_ns);
  const TimeNs usual = usual_interval(intervals);
  const auto near = [&](TimeNs a, TimeNs b) { return std::abs(a - b) <= usual / 20; };
  std::size_t regular = 0, run = 0, longest = 0, end = 0;
  for (std::size_t k = 0; k + 1 < intervals.size(); ++k) {
    const TimeNs a = intervals[k], b = intervals[k + 1];
    regular += near(a, usual) ? 1 : 0;
    const bool alternates = near(a + b, usual) && !near(a, b) && (run == 0 || near(b, intervals[k - 1]));
    run = alternates ? run + 1 : 0;
    if (run > longest) longest = run, end = k + 1;
  }
  if (longest < kLeast || regular < kLeast) return std::nullopt;
  const TimeNs begin_ns = images[end - longest].time_ns, first_ns = images.front().time_ns;
  return fmt::format(
      "{}: from {:.3f} to {:.3f} s there are two images in each interval of {:.1f} ms, {:.1f} and {:.1f} ms apart, as "
      "if the clock was set back during the recording, or two recordings were mixed: poses there are wrong then",
      image_files::source_of(images.front()), to_seconds(begin_ns - first_ns),
      to_seconds(images[end + 1].time_ns - first_ns), 1e3 * to_seconds(usual), 1e3 * to_seconds(intervals[end - 1]),
      1e3 * to_seconds(intervals[end]));
}

std::optional<std::string> unreadable_note(const Images& images) {
  constexpr std::size_t kTries = 5;
  const std::size_t count = std::min(kTries, images.size());
  std::size_t unreadable = 0;
  std::string first;
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t at = count == 1 ? 0 : (images.size() - 1) * k / (count - 1);
    const auto image = image_decoding::read_image(images[at]);
    if (!image && unreadable++ == 0)
      first = fmt::format("{} ({})", image_files::name_of(images[at]), image.error().found);
  }
  if (unreadable == 0) return std::nullopt;
  return fmt::format("{} of {} images that were tried cannot be decoded, the first: {}", unreadable, count, first);
}

}  // namespace bslam::dataset
