// Errors as values: what the outside can cause is an Error. The types are those of the public header.
#pragma once

#include <bslam/result.h>

#include "base/assert.h"
