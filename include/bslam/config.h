// Settings of a run.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "bslam/export.h"
#include "bslam/result.h"

namespace bslam {

namespace api {
struct Access;  // access of the library to the implementations
}

// When mapping and loop closing run.
enum class Mode {
  kSequential,  // in the caller's thread before the next frame: identical results on every run
  kLagged,      // in separate threads; each result is used a fixed number of frames later: identical results as well
  kParallel     // in separate threads; each result is used as soon as it is available: for live use, the default
};
// In the last two modes a frame does not wait for the first tests of the calibration against the images, as it does in
// bslam run. Set execution.await_calibration for recordings with a calibration that may be wrong, and
// execution.await_mapping_s for recordings that are passed faster than they were captured in parallel mode.

// Description of one setting.
struct Setting {
  std::string name;      // "features.per_image"
  std::string value;     // current value, as text that Config::set accepts
  std::string expected;  // "an integer in [50, 20000]", "one of: sequential, lagged, parallel"
  std::string unit;      // may be empty
  std::string help;
};

// The settings of a run, a value type whose copies are independent. Every setting has a default, and its value is
// always valid.
class BSLAM_EXPORT Config {
 public:
  Config();
  Config(const Config& other);
  Config& operator=(const Config& other);
  ~Config();

  // Sets one setting from text. On error the setting keeps its value. Errors: an unknown name (the message suggests the
  // nearest one), a value of another type or out of range. Here and in files, the name that a setting had in the
  // release before is accepted; System::create then logs a warning with its present name.
  Status set(std::string_view name, std::string_view value);
  void set_mode(Mode mode);
  Status set_seed(int seed);  // seed of all random numbers; must not be negative

  // Reads settings from a YAML file such as the config.yaml written by `bslam run`. Settings that are not in the file
  // keep their values. Errors name file and key; on error no setting is changed.
  Status load(const std::filesystem::path& file);

  // Returns the value of a setting as text. Error: an unknown name.
  Result<std::string> get(std::string_view name) const;
  std::vector<Setting> settings() const;
  std::string to_yaml() const;  // `load` restores exactly the same values

 private:
  friend struct api::Access;
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace bslam
