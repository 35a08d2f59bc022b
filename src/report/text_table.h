// A table as plain text for a terminal.
#pragma once

#include <string>

#include "report/document.h"

namespace bslam::report {

// Returns the title, the columns and the rows, each as a line. The first column is aligned to the left, the others to
// the right.
std::string text_table(const Table& table);

}  // namespace bslam::report
