// Implementation of the public class Config.
#pragma once

#include <bslam/config.h>

#include <algorithm>
#include <string>
#include <vector>

#include "system/config.h"

namespace bslam {

struct Config::Impl {
  system::Config config;
  std::vector<std::string> warnings;  // one sentence for every former name of a setting that was used

  // Keeps the warnings of a table that has set options; each is kept once.
  void keep(const std::vector<std::string>& of_table) {
    for (const std::string& warning : of_table) {
      if (std::ranges::find(warnings, warning) == warnings.end()) warnings.push_back(warning);
    }
  }
};

}  // namespace bslam
