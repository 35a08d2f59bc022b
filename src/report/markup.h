// Text in XML and HTML.
#pragma once

#include <string>
#include <string_view>

namespace bslam::report {

// Returns text for XML and HTML. XML allows neither control characters nor bytes that are not UTF-8, both of which file
// names may contain; they become question marks.
std::string escaped(std::string_view text);

}  // namespace bslam::report
