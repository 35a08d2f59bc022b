// The page that shows a run in a browser. Its sources are in web/; scripts/build_web makes one file of them, which is
// embedded in the program.
#pragma once

#include <string>
#include <string_view>

namespace bslam::report {

// The page without data. It shows the data that are passed to its function `bslam.show`.
std::string_view empty_page();

// Returns the page with data, which it shows when it is opened. `json` may contain any text: it cannot end the element
// that holds it.
std::string page_with_data(std::string_view json);

}  // namespace bslam::report
