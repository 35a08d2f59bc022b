// Implementation of the public class Config.
#pragma once

#include <bslam/config.h>

#include "system/config.h"

namespace bslam {

struct Config::Impl {
  system::Config config;
};

}  // namespace bslam
