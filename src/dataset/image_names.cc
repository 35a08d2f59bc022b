#include "dataset/image_names.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>

#include "base/lower_case.h"
#include "base/number_text.h"
#include "evaluation/trajectory_file.h"
#include "image/frame_grouping.h"

namespace bslam::dataset {
namespace {

namespace fs = std::filesystem;

bool is_digit(char c) { return c >= '0' && c <= '9'; }

// The extension in lower case, without the point.
std::string kind_of(const fs::path& file) {
  const std::string extension = lower_case(file.extension().string());
  return extension.substr(extension.starts_with('.') ? 1 : 0);
}

// A name without its extension, split into its numbers and the texts before, between and after them (one text more than
// numbers).
struct SplitName {
  fs::path file;
  std::vector<std::string> numbers, texts = {""};
};

SplitName split_name(const fs::path& file) {
  SplitName out{.file = file, .numbers = {}};
  bool in_number = false;
  for (const char c : file.stem().string()) {
    if (is_digit(c)) {
      if (!in_number) out.numbers.emplace_back();
      out.numbers.back() += c;
    } else {
      if (in_number) out.texts.emplace_back();
      out.texts.back() += c;
    }
    in_number = is_digit(c);
  }
  if (in_number) out.texts.emplace_back();
  return out;
}

// Names of one kind have the same texts, and the same extension. PNG and JPEG may be mixed.
using Kind = std::pair<std::vector<std::string>, std::string>;
using Group = std::vector<SplitName>;
using Kinds = std::map<Kind, Group>;

bool of_digits_only(const Kind& kind) { return kind.first == std::vector<std::string>{"", ""}; }

Kinds kinds_of(const std::vector<fs::path>& files) {
  Kinds kinds;
  for (const fs::path& file : files) {
    SplitName name = split_name(file);
    std::string extension = kind_of(file);
    if (image_files::is_png_or_jpeg_name(file)) extension.clear();
    if (extension == "tiff") extension = "tif";
    Kind kind{name.texts, extension};
    kinds[std::move(kind)].push_back(std::move(name));
  }
  return kinds;
}

// Returns the only kind of names that several images have. Names of digits only take precedence, and among these PNG
// and JPEG, which come first in the order of kinds.
Result<const Group*> chosen_kind(const fs::path& folder, const Kinds& kinds) {
  std::vector<const Kinds::value_type*> several, single;
  for (const auto& entry : kinds) {
    if (entry.first.first.size() > 1) (entry.second.size() > 1 ? several : single).push_back(&entry);
  }
  auto& found = several.empty() ? single : several;
  const auto others = [](const auto* entry) { return !of_digits_only(entry->first); };
  const bool digits = !std::ranges::all_of(found, others);
  if (digits) std::erase_if(found, others);
  if (found.size() == 1 || (digits && found[0]->first.second.empty())) return &found[0]->second;
  if (found.empty())
    return Error{folder.string(), "", "no images with a number in their names", "images named by their time stamps"};
  return Error{
      folder.string(), "",
      fmt::format("images with names of several kinds, such as {} and {}",
                  found[0]->second.front().file.filename().string(), found[1]->second.front().file.filename().string()),
      "one kind of names in a folder, and a folder for each camera"};
}

// Returns which of the numbers differ between the names.
std::vector<std::size_t> varying_numbers(const Group& group) {
  std::vector<std::size_t> varying;
  for (std::size_t k = 0; k < group.front().numbers.size(); ++k) {
    if (std::ranges::any_of(group, [&](const SplitName& name) { return name.numbers[k] != group[0].numbers[k]; }))
      varying.push_back(k);
  }
  if (!varying.empty()) return varying;
  // No number varies, as with a single image: take the longest.
  const auto longest = std::ranges::max_element(group.front().numbers, {}, &std::string::size);
  return {static_cast<std::size_t>(longest - group.front().numbers.begin())};
}

// Returns the first of two numbers that are decimal seconds, "1403636579.763555527", if all that differs is in them.
std::optional<std::size_t> decimal_seconds(const Group& group, const std::vector<std::size_t>& varying) {
  const SplitName& name = group.front();
  for (std::size_t k = 0; k + 1 < name.numbers.size(); ++k) {
    const bool begins = name.texts[k].empty() || std::string_view("_- ").find(name.texts[k].back()) < 3;
    if (name.texts[k + 1] != "." || !begins || name.texts[k + 2].starts_with('.')) continue;
    if (std::ranges::all_of(varying, [&](std::size_t v) { return v == k || v == k + 1; })) return k;
  }
  return std::nullopt;
}

// Some programs drop trailing zeros of the fraction; others print an integer number of nanoseconds, microseconds or
// milliseconds after the point without leading zeros.
enum class Fraction { kDecimal, kUnpadded };

std::optional<TimeNs> seconds_of(const SplitName& name, std::size_t seconds, Fraction fraction,
                                 std::size_t most_digits) {
  std::string digits = name.numbers[seconds + 1];
  if (fraction == Fraction::kUnpadded) digits.insert(0, most_digits - digits.size(), '0');
  return evaluation::parse_seconds(name.numbers[seconds] + "." + digits);
}

// How far the intervals between images are from being equal: the sum of their differences from the median, over the
// median.
double irregularity(const Group& group, std::size_t seconds, Fraction fraction, std::size_t most_digits) {
  std::vector<TimeNs> times;
  for (const SplitName& name : group) {
    if (const auto time = seconds_of(name, seconds, fraction, most_digits)) times.push_back(*time);
  }
  std::ranges::sort(times);
  const auto median = static_cast<double>(image::median_interval(times));
  double sum = 0;
  for (std::size_t k = 1; k < times.size(); ++k) sum += std::abs(static_cast<double>(times[k] - times[k - 1]) - median);
  return sum / std::max(median, 1.0);
}

// Returns at which end zeros were dropped, if not all names have the same number of digits after the point. A shorter
// fraction of several digits that ends in 0 rules out dropped trailing zeros; a fraction that begins with 0 rules out
// dropped leading zeros.
Result<Fraction> fraction_of(const fs::path& folder, const Group& group, std::size_t seconds) {
  constexpr double kClearly = 3;
  const auto digits = [&](const SplitName& name) -> const std::string& { return name.numbers[seconds + 1]; };
  const auto [least, most] =
      std::ranges::minmax_element(group, {}, [&](const SplitName& name) { return digits(name).size(); });
  const std::size_t longest = digits(*most).size();
  if (digits(*least).size() == longest) return Fraction::kDecimal;
  const auto ends_early = [&](const SplitName& name) {
    return digits(name).size() > 1 && digits(name).size() < longest && digits(name).ends_with('0');
  };
  const auto is_padded = [&](const SplitName& name) {
    return digits(name).size() > 1 && digits(name).starts_with('0');
  };
  const bool may_be_decimal = std::ranges::none_of(group, ends_early);
  const bool is_unit = longest == 3 || longest == 6 || longest == 9;
  const bool may_be_unpadded = is_unit && std::ranges::none_of(group, is_padded);
  if (may_be_decimal && !may_be_unpadded) return Fraction::kDecimal;
  if (may_be_unpadded && !may_be_decimal) return Fraction::kUnpadded;
  if (may_be_decimal) {
    const double decimal = irregularity(group, seconds, Fraction::kDecimal, longest),
                 unpadded = irregularity(group, seconds, Fraction::kUnpadded, longest);
    if (decimal > kClearly * unpadded) return Fraction::kUnpadded;
    if (unpadded > kClearly * decimal) return Fraction::kDecimal;
  }
  return Error{folder.string(), "",
               fmt::format("seconds with {} and with {} digits after the point ({}, {})", digits(*least).size(),
                           longest, least->file.filename().string(), most->file.filename().string()),
               "the same number of digits after the point in all names: it is unclear at which end zeros were dropped"};
}

std::string example_names(const Group& group) {
  return group.front().file.filename().string() + " and " + group.back().file.filename().string();
}

Result<NamedImages> read_names(const fs::path& folder, const Group& group) {
  NamedImages out;
  const std::vector<std::size_t> varying = varying_numbers(group);
  const auto seconds = decimal_seconds(group, varying);
  if (varying.size() > 1 && !seconds) {
    return Error{folder.string(), "", "names in which several numbers differ, such as " + example_names(group),
                 "names that differ in one number, or times.txt with lines of TIME FILENAME"};
  }
  Fraction fraction = Fraction::kDecimal;
  std::size_t most_digits = 0;
  if (seconds) {
    const auto found = fraction_of(folder, group, *seconds);
    if (!found) return found.error();
    fraction = *found;
    for (const SplitName& name : group) most_digits = std::max(most_digits, name.numbers[*seconds + 1].size());
  }
  out.in_seconds = seconds.has_value();
  for (const SplitName& name : group) {
    if (seconds) {
      if (const auto time = seconds_of(name, *seconds, fraction, most_digits)) {
        out.images.push_back({name.file, *time});
        continue;
      }
    } else if (const auto number = parse_integer(name.numbers[varying.front()])) {
      out.images.push_back({name.file, *number});
      continue;
    }
    if (out.left_out_count++ == 0) out.left_out = name.file.string();
  }
  if (out.images.empty())
    return Error{folder.string(), "", "names such as " + group.front().file.filename().string(),
                 "numbers below 9223372036854775808"};
  std::ranges::sort(out.images, [](const auto& a, const auto& b) {
    return a.time_ns != b.time_ns ? a.time_ns < b.time_ns : a.path < b.path;
  });
  return out;
}

}  // namespace

std::vector<fs::path> image_files_of(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code error;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    if (image_files::is_image_name(it->path()) && !it->path().filename().string().starts_with('.'))
      files.push_back(it->path());
  }
  std::ranges::sort(files, {}, [](const fs::path& file) -> const std::string& { return file.native(); });
  return files;
}

bool is_undecodable_image(const fs::path& file) {
  constexpr std::array<std::string_view, 11> kKinds = {"gif", "jp2",  "exr",  "hdr", "dng", "raw",
                                                       "tga", "heic", "avif", "jxl", "pfm"};
  return std::ranges::find(kKinds, kind_of(file)) != kKinds.end();
}

bool naturally_before(const std::string& a, const std::string& b) {
  const auto parts = [](const std::string& text) {
    std::vector<std::pair<std::int64_t, std::string>> out;  // a number, or a text
    for (std::size_t at = 0; at < text.size();) {
      std::size_t end = at + 1;
      while (end < text.size() && is_digit(text[end]) == is_digit(text[at])) ++end;
      const std::string part = text.substr(at, end - at);
      out.emplace_back(parse_integer(part).value_or(-1), part);
      at = end;
    }
    return out;
  };
  return std::pair(parts(a), a) < std::pair(parts(b), b);
}

Result<NamedImages> images_by_name(const fs::path& folder, const std::vector<fs::path>& files) {
  const Kinds kinds = kinds_of(files);
  const auto chosen = chosen_kind(folder, kinds);
  if (!chosen) return chosen.error();
  auto out = read_names(folder, **chosen);
  if (!out) return out;
  for (const auto& [kind, group] : kinds) {
    if (&group == *chosen) continue;
    if (out->left_out_count == 0) out->left_out = group.front().file.string();
    out->left_out_count += group.size();
  }
  return out;
}

}  // namespace bslam::dataset
