#include "session/earlier_results.h"

#include <algorithm>
#include <array>
#include <string>
#include <system_error>

namespace bslam::session {
namespace {

namespace fs = std::filesystem;

// All but trajectories.
constexpr std::array<std::string_view, 8> kNames = {"config.yaml",  "covariance_live.csv", "report.html",
                                                    "rerun.log",    "rig_refined.yaml",    "run.svg",
                                                    "summary.json", "trajectory.svg"};

// trajectory.tum, trajectory_part2.tum, and the same of trajectory_live.
bool is_trajectory(std::string_view name) {
  constexpr std::string_view kEnd = ".tum", kPart = "_part";
  if (!name.ends_with(kEnd)) return false;
  name.remove_suffix(kEnd.size());
  for (const std::string_view stem : {"trajectory_live", "trajectory"}) {
    if (name == stem) return true;
    if (!name.starts_with(std::string(stem) + std::string(kPart))) continue;
    const std::string_view number = name.substr(stem.size() + kPart.size());
    return !number.empty() && number.find_first_not_of("0123456789") == std::string_view::npos;
  }
  return false;
}

// The names of the results in a folder. Folders are none, whatever their names.
std::vector<fs::path> results_in(const fs::path& folder) {
  std::vector<fs::path> names;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    const fs::path name = entry->path().filename();
    if (is_result_file(name.string()) && !entry->is_directory(error)) names.push_back(name);
  }
  std::ranges::sort(names);
  return names;
}

}  // namespace

bool is_result_file(std::string_view name) { return std::ranges::count(kNames, name) > 0 || is_trajectory(name); }

EarlierResults::EarlierResults(fs::path folder) : folder_(std::move(folder)) {
  while (!results_in(aside(number_)).empty()) ++number_;
}

fs::path EarlierResults::aside(int number) const {
  return folder_ / (number == 1 ? "earlier_results" : "earlier_results_" + std::to_string(number));
}

void EarlierResults::remove(int number) const {
  std::error_code ignored;
  for (const fs::path& name : results_in(aside(number))) fs::remove(aside(number) / name, ignored);
  fs::remove(aside(number), ignored);  // unless there are other files
}

Result<EarlierResults> EarlierResults::move_aside(const fs::path& folder, const std::vector<fs::path>& inputs) {
  EarlierResults results(folder);
  const fs::path aside = results.aside(results.number_);
  for (const fs::path& name : results_in(folder)) {
    std::error_code error;
    const fs::path file = folder / name;
    const auto is_file = [&](const fs::path& input) { return !input.empty() && fs::equivalent(file, input, error); };
    if (std::ranges::any_of(inputs, is_file)) continue;
    fs::create_directory(aside, error);
    if (!error) fs::rename(file, aside / name, error);
    if (error) {
      const std::string reason = error.message();
      fs::remove(aside, error);  // unless files were moved there
      return Error{file.string(), "--overwrite", reason, "a file of an earlier run that can be replaced"};
    }
    results.moved_.push_back(name);
  }
  return results;
}

EarlierResults::~EarlierResults() {
  if (moved_.empty()) return;
  std::error_code ignored;
  for (const fs::path& name : moved_) fs::rename(aside(number_) / name, folder_ / name, ignored);
  fs::remove(aside(number_), ignored);  // unless there are other files
}

void EarlierResults::replace(bool by_complete_run) {
  for (int number = by_complete_run ? 1 : number_; number <= number_; ++number) remove(number);
  moved_.clear();
}

}  // namespace bslam::session
