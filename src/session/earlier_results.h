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
// results of the run that was killed; the next run then uses FOLDER/earlier_results_2, and so on.
class EarlierResults {
 public:
  // Moves all results in `folder` aside but those that are an input of the new run. Empty names of inputs are ignored.
  // Error: a file cannot be moved; then all are where they were.
  static Result<EarlierResults> move_aside(const std::filesystem::path& folder,
                                           const std::vector<std::filesystem::path>& inputs);

  EarlierResults(EarlierResults&& other) noexcept
      : folder_(std::move(other.folder_)), number_(other.number_), moved_(std::exchange(other.moved_, {})) {}
  EarlierResults& operator=(EarlierResults&&) = delete;
  ~EarlierResults();

  // Whether there are any.
  bool any() const { return !moved_.empty(); }

  // Removes them: the results of the new run take their place. If it is complete, those which runs that were killed
  // have left are removed as well.
  void replace(bool by_complete_run = true);

 private:
  explicit EarlierResults(std::filesystem::path folder);
  std::filesystem::path aside(int number) const;
  void remove(int number) const;

  std::filesystem::path folder_;
  int number_ = 1;                            // of the first folder without results that a killed run has left
  std::vector<std::filesystem::path> moved_;  // names of files
};

}  // namespace bslam::session
