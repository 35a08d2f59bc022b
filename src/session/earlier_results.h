// The results of an earlier run in the output folder of a new one.
#pragma once

#include <filesystem>
#include <string_view>
#include <utility>
#include <vector>

#include "base/result.h"

namespace bslam::session {

// Whether the name is that of a file that `bslam run` writes to its output folder.
bool is_result_file(std::string_view name);

// Keeps the results of an earlier run in FOLDER/earlier_results while a new run goes on. Without replace(), the
// destructor moves them back. If the program is killed they stay there, so that they are neither lost nor taken for
// results of the run that was killed.
class EarlierResults {
 public:
  // Moves all results in `folder` aside but those that are an input of the new run. Empty names of inputs are ignored.
  // Error: a file cannot be moved; then all are where they were.
  static Result<EarlierResults> move_aside(const std::filesystem::path& folder,
                                           const std::vector<std::filesystem::path>& inputs);

  EarlierResults(EarlierResults&& other) noexcept
      : folder_(std::move(other.folder_)), moved_(std::exchange(other.moved_, {})) {}
  EarlierResults& operator=(EarlierResults&&) = delete;
  ~EarlierResults();

  // Removes them, and those which a run that was killed has left: the results of the new run take their place.
  void replace();

 private:
  explicit EarlierResults(std::filesystem::path folder) : folder_(std::move(folder)) {}
  std::filesystem::path aside() const { return folder_ / "earlier_results"; }

  std::filesystem::path folder_;
  std::vector<std::filesystem::path> moved_;  // names of files
};

}  // namespace bslam::session
