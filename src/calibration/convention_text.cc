// Texts for users about the results of calibration/convention_check.h.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <set>

#include "calibration/convention_check.h"

namespace bslam::calibration {

std::string_view convention_in_words(Convention convention) {
  switch (convention) {
    case Convention::kAsGiven:
      return "as given";
    case Convention::kInverse:
      return "with every transform inverted (T_cam_body instead of T_body_cam)";
    case Convention::kPairInverse:
      return "with the transform between the two inverted, or the two cameras exchanged";
    case Convention::kSwapped:
      return "with the two cameras exchanged";
    case Convention::kMirrored:
      return "if the images of both cameras are mirrored left to right";
    case Convention::kUpsideDown:
      return "if the images of both cameras are rotated by 180 degrees";
    case Convention::kSwappedInverse:
      break;
  }
  return "with the two cameras exchanged and every transform inverted";
}

namespace {

// Returns true if there are so many matches that some convention should fit, but none does.
bool fits_no_convention(const PairEvidence& pair) {
  constexpr int kMany = 300;  // matches
  return !pair.verdict && pair.matches > kMany;
}

// The other mistakes that explain as many matches as the one that was found, in words.
std::string or_by_images(const PairEvidence& pair) {
  std::string text;
  for (const Convention other : {Convention::kMirrored, Convention::kUpsideDown}) {
    if (pair.verdict && *pair.verdict != other && pair.fit_as_well(*pair.verdict, other))
      text += fmt::format(", or {}", convention_in_words(other));
  }
  return text;
}

}  // namespace

std::string describe_pair(const PairEvidence& pair) {
  if (pair.mirrored) {
    return fmt::format(
        "{} of {} matches are consistent with the calibration if the images of camera {} are mirrored left to "
        "right; {} with it as given",
        pair.mirrored->agreeing, pair.mirrored->matches, pair.mirrored->camera, pair.with(Convention::kAsGiven));
  }
  if (pair.exchanged) {
    return fmt::format(
        "{} of {} matches are consistent with the calibrations of {} and {} in place of those of the two cameras; {} "
        "with the calibration as given",
        pair.exchanged->agreeing, pair.matches, pair.exchanged->cameras[0], pair.exchanged->cameras[1],
        pair.with(Convention::kAsGiven));
  }
  if (pair.other) {
    return fmt::format(
        "{} of {} matches are consistent with a pose of the second camera that is rotated by {:.1f} degrees from the "
        "calibrated one, with a baseline whose direction differs by {:.0f} degrees; {} with the calibration as given",
        pair.other->agreeing, pair.matches, pair.other->rotated_deg, pair.other->displaced_deg,
        pair.with(Convention::kAsGiven));
  }
  if (pair.instants == 0) return "not tested: no images taken at the same time, so there is nothing to compare";
  if (fits_no_convention(pair))
    return fmt::format("{} matches, but too few are consistent with any convention", pair.matches);
  if (!pair.verdict)
    return fmt::format("not tested: too few matches for a decision ({}); the calibrated views overlap by {:.0f} %",
                       pair.matches, 100 * pair.overlap);
  std::string text = fmt::format("{} of {} matches are consistent with the calibration {}", pair.with(*pair.verdict),
                                 pair.matches, convention_in_words(*pair.verdict));
  if (*pair.verdict != Convention::kAsGiven)
    return text + fmt::format("{}; {} with it as given", or_by_images(pair), pair.with(Convention::kAsGiven));
  if (pair.with(Convention::kAsGiven) < kGoodShare * pair.matches)
    text += "; this is few: many matches are wrong, or the intrinsics are inaccurate";
  return text;
}

namespace {

std::string name_of(const PairEvidence& pair) { return fmt::format("{} and {}", pair.first, pair.second); }

std::string_view why_untested(const PairEvidence& pair) {
  if (pair.instants == 0) return "no images taken at the same time";
  if (fits_no_convention(pair))
    return "matches that fit no convention (wrong intrinsics or time stamps, or things that look alike)";
  return pair.overlap < kSomeOverlap ? "views that hardly overlap" : "too few matches";
}

// For rigs without a fault: the pairs that could not be tested with the reasons, and the cameras of which no pair could
// be tested.
std::string untested_text(std::span<const PairEvidence> evidence) {
  constexpr std::size_t kShown = 6;
  std::map<std::string_view, std::vector<std::string>> pairs;  // by reason
  std::set<std::size_t> cameras, judged;
  for (const PairEvidence& pair : evidence) {
    if (!pair.is_judged()) pairs[why_untested(pair)].push_back(name_of(pair));
    for (const std::size_t c : {pair.first, pair.second}) (pair.is_judged() ? judged : cameras).insert(c);
  }
  std::string text;
  for (auto& [reason, names] : pairs) {
    const std::size_t more = names.size() - std::min(names.size(), kShown);
    names.resize(names.size() - more);
    text += fmt::format("  not tested because of {}: cameras {}{}\n", reason, fmt::join(names, ", "),
                        more > 0 ? fmt::format(" and {} more pairs", more) : "");
  }
  std::erase_if(cameras, [&](std::size_t c) { return judged.contains(c); });
  if (!cameras.empty())
    text += fmt::format("  nothing is known of the extrinsics of cameras in no tested pair: {}\n",
                        fmt::join(cameras, ", "));
  return text;
}

// Pairs that could not be tested although their calibrated views overlap.
std::string warning_of_untested(std::span<const PairEvidence> evidence) {
  constexpr double kMuchOverlap = 0.4;  // opposite fisheyes with less hardly match at the edges of their views
  std::vector<std::string> untested;
  std::size_t common = 0;
  for (const PairEvidence& pair : evidence) {
    if (pair.overlap < kMuchOverlap) continue;
    ++common;
    if (!pair.is_judged()) untested.push_back(name_of(pair));
  }
  if (untested.empty()) return "";
  return fmt::format("warning: {} of {} pairs with much overlap could not be tested: cameras {}\n", untested.size(),
                     common, fmt::join(untested, ", "));
}

}  // namespace

std::string describe_evidence(std::span<const PairEvidence> evidence) {
  std::string text = "test against the images:\n";
  std::set<std::size_t> mirrored;
  std::map<Convention, std::vector<std::string>> mistakes;  // pairs
  std::map<Convention, std::string> others_of;              // by mistake: others that explain as many matches
  int fitting = 0, elsewhere = 0, exchanged = 0;
  for (const PairEvidence& pair : evidence) {
    text += fmt::format("  cameras {} and {}: {}\n", pair.first, pair.second, describe_pair(pair));
    if (pair.mirrored) mirrored.insert(pair.mirrored->camera);
    elsewhere += pair.other ? 1 : 0;
    exchanged += pair.exchanged ? 1 : 0;
    if (pair.verdict == Convention::kAsGiven) ++fitting;
    if (pair.verdict && pair.verdict != Convention::kAsGiven) {
      mistakes[*pair.verdict].push_back(name_of(pair));
      if (const std::string or_others = or_by_images(pair); !or_others.empty()) others_of[*pair.verdict] = or_others;
    }
  }
  for (const std::size_t camera : mirrored)
    text += fmt::format("warning: the images of camera {} are mirrored left to right\n", camera);
  if (!mistakes.empty()) {
    const auto most = std::ranges::max_element(mistakes, {}, [](const auto& mistake) { return mistake.second.size(); });
    const auto& pairs = most->second;
    const std::string others =
        fitting > 0 ? fmt::format("; {} of {} pairs are consistent as given", fitting, evidence.size()) : "";
    return text +
           fmt::format(
               "warning: the images of cameras {} contradict the extrinsics; they are consistent with them {}{}{}\n",
               fmt::join(pairs, ", "), convention_in_words(most->first), others_of[most->first], others);
  }
  if (exchanged > 0)
    return text + "warning: the images contradict the extrinsics; they are consistent with exchanged cameras\n";
  if (elsewhere > 0) return text + "warning: the images contradict the extrinsics, and no common mistake explains it\n";
  text += warning_of_untested(evidence);
  if (!mirrored.empty()) return text;
  if (fitting == 0) return text + "  the extrinsics could not be tested\n" + untested_text(evidence);
  const bool all = static_cast<std::size_t>(fitting) == evidence.size();
  text +=
      all ? "  the extrinsics are consistent with the images\n"
          : fmt::format("  {} of {} pairs could be tested, and the images are consistent with the extrinsics of {}\n",
                        fitting, evidence.size(), fitting == 1 ? "this one" : "these");
  return text + untested_text(evidence) +
         "  focal lengths and distortion are hardly tested by pairs of images: `bslam run` estimates them from the "
         "motion of the rig\n";
}

}  // namespace bslam::calibration
