// The Error of a command that ends before it has written anything, because the user has interrupted it.
#pragma once

#include <stop_token>

#include "base/result.h"

namespace bslam {

// An Error if a stop was requested.
Status not_interrupted(const std::stop_token& interrupted);

}  // namespace bslam
