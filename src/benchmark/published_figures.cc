#include "benchmark/published_figures.h"

#include <algorithm>
#include <cctype>
#include <span>

namespace bslam::benchmark {
namespace {

constexpr std::nullopt_t kNone = std::nullopt;

constexpr std::string_view kEurocSequences[] = {"mh01", "mh02", "mh03", "mh04", "mh05", "v101",
                                                "v102", "v103", "v201", "v202", "v203"};
constexpr std::string_view kKittiSequences[] = {"00", "01", "02", "03", "04", "05", "06", "07", "08", "09", "10"};

constexpr std::string_view kFloor =
    "computed from the ground truth: positions of camera 0 against those of the body, V1_01 with the released "
    "orientation";
constexpr std::string_view kBundledSlam =
    "Song, Liu, Dai: BundledSLAM: An Accurate Visual SLAM System Using Multiple Cameras";
constexpr std::string_view kOrbSlam2 =
    "Mur-Artal, Tardos: ORB-SLAM2, IEEE Transactions on Robotics 2017, table II (median of 5 runs)";
constexpr std::string_view kOrbSlam3 =
    "Campos et al.: ORB-SLAM3, IEEE Transactions on Robotics 2021, table II (median of 10 runs)";
constexpr std::string_view kQuoted = "quoted in table II of Campos et al.: ORB-SLAM3, 2021";
constexpr std::string_view kDroid = "Teed, Deng: DROID-SLAM, NeurIPS 2021";

// clang-format off
constexpr PublishedRow kEurocRows[] = {
    {"perfect camera path", Protocol::kP, kFloor, true, {.040, .038, .039, .032, .031, .090, .060, .056, .058, .055, .061}},
    {"BundledSLAM, best", Protocol::kP, kBundledSlam, true, {.034, .035, .056, .046, .057, .086, .064, .068, .060, .054, kNone}},
    {"BundledSLAM, average", Protocol::kP, kBundledSlam, true, {.036, .044, .064, .092, .081, .087, .065, .097, .061, .056, kNone}},
    {"ORB-SLAM2, best", Protocol::kP, kBundledSlam, true, {.038, .042, .058, .067, .051, .087, .064, .072, .056, .056, kNone}},
    {"ORB-SLAM2, average", Protocol::kP, kBundledSlam, true, {.039, .046, .066, .115, .089, .087, .065, .090, .064, .069, kNone}},
    {"VINS-Stereo, best", Protocol::kP, kBundledSlam, true, {.228, .267, .148, .396, .249, .405, .201, 1.259, .117, .193, kNone}},
    {"ORB-SLAM2 stereo", Protocol::kT, kOrbSlam2, false, {.035, .018, .028, .119, .060, .035, .020, .048, .037, .035, kNone}},
    {"ORB-SLAM3 stereo", Protocol::kT, kOrbSlam3, false, {.029, .019, .024, .085, .052, .035, .025, .061, .041, .028, .521}},
    {"VINS-Fusion stereo", Protocol::kT, kQuoted, false, {.540, .460, .330, .780, .500, .550, .230, kNone, .230, .200, kNone}},
    {"SVO stereo", Protocol::kT, kQuoted, false, {.040, .070, .270, .170, .120, .040, .040, .070, .050, .090, .790}},
    {"DROID-SLAM stereo", Protocol::kT, kDroid, false, {.015, .013, .035, .048, .040, .037, .011, .020, .018, .015, .017}}};
constexpr PublishedRow kKittiRows[] = {
    {"ORB-SLAM2 stereo", Protocol::kT, "Mur-Artal, Tardos: ORB-SLAM2, IEEE Transactions on Robotics 2017, table I", false,
     {1.3, 10.4, 5.7, .6, .2, .8, .8, .5, 3.6, 3.2, 1.0}}};
// clang-format on

// A public set of sequences with figures.
struct Suite {
  std::span<const std::string_view> sequences;  // at most 11
  std::span<const PublishedRow> rows;
};
constexpr Suite kSuites[] = {{kEurocSequences, kEurocRows}, {kKittiSequences, kKittiRows}};

// Returns the letters and digits in lower case, without the difficulty that ends the names of EuRoC sequences.
std::string plain_name(std::string_view name) {
  std::string plain;
  for (const char c : name) {
    if (std::isalnum(static_cast<unsigned char>(c))) {
      plain += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    }
  }
  for (const std::string_view difficulty : {"easy", "medium", "difficult"}) {
    if (plain.ends_with(difficulty)) plain.resize(plain.size() - difficulty.size());
  }
  return plain;
}

}  // namespace

std::vector<PublishedFigure> published_figures(std::string_view sequence_name) {
  const std::string name = plain_name(sequence_name);
  std::vector<PublishedFigure> figures;
  for (const Suite& suite : kSuites) {
    const auto found = std::ranges::find(suite.sequences, name);
    if (found == suite.sequences.end()) continue;
    const auto index = static_cast<std::size_t>(found - suite.sequences.begin());
    for (const PublishedRow& row : suite.rows) {
      if (row.ate_m[index]) figures.push_back({&row, *row.ate_m[index]});
    }
  }
  return figures;
}

}  // namespace bslam::benchmark
