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
struct Access;  // how the library itself reads what these classes hide
}

// When mapping and loop closing run.
enum class Mode {
  kSequential,  // in the caller's thread before the next frame: identical results on every run
  kLagged,      // in threads of their own, each result used a fixed number of frames later: identical results as well
  kParallel     // in threads of their own, each result used as soon as it is there: for live use, the default
};

// One setting, described.
struct Setting {
  std::string name;      // "features.per_image"
  std::string value;     // in force, as text that Config::set takes
  std::string expected;  // "an integer in [50, 20000]", "one of: sequential, lagged, parallel"
  std::string unit;      // may be empty
  std::string help;
};

// A value: copies are independent. Every setting has a default; all values it can hold are valid.
class BSLAM_EXPORT Config {
 public:
  Config();
  Config(const Config& other);
  Config& operator=(const Config& other);
  ~Config();

  // Errors, which leave the setting as it was: an unknown name (the nearest one is told), a value of another type or
  // out of range.
  Status set(std::string_view name, std::string_view value);
  void set_mode(Mode mode);
  Status set_seed(int seed);  // of all randomness; not below 0

  // Settings of a YAML file, as `bslam run` writes it to config.yaml; what it does not name stays as it is. Errors name
  // file and key; nothing is changed then.
  Status load(const std::filesystem::path& file);

  // Errors: an unknown name.
  Result<std::string> get(std::string_view name) const;
  std::vector<Setting> settings() const;
  std::string to_yaml() const;  // what `load` reads back exactly

 private:
  friend struct api::Access;
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace bslam
