// Errors as values: everything a user or a file can cause is returned as an Error, which the command line prints as one
// line. The types are defined in the public header.
#pragma once

#include <bslam/result.h>

#include "base/assert.h"
