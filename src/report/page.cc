#include "report/page.h"

#include <algorithm>

#include "base/assert.h"
#include "base/embedded_file.h"

namespace bslam::report {
namespace {

constexpr std::string_view kPlaceholder = R"(<script type="application/json" id="bslam-data">null</script>)";
constexpr std::string_view kNull = "null</script>";

}  // namespace

BSLAM_EMBED_FILE(empty_page, BSLAM_REPORT_PAGE)

std::string page_with_data(std::string_view json) {
  const std::string_view page = empty_page();
  const std::size_t placeholder = page.find(kPlaceholder);
  BSLAM_ASSERT(placeholder != std::string_view::npos, "the page has no place for data");
  const std::size_t at = placeholder + kPlaceholder.size() - kNull.size();
  std::string out;
  out.reserve(page.size() + json.size() + json.size() / 64);
  out += page.substr(0, at);
  // Outside of strings JSON has no '<', and in strings it can be written as an escape sequence.
  for (std::size_t from = 0; from < json.size();) {
    const std::size_t next = std::min(json.find('<', from), json.size());
    out += json.substr(from, next - from);
    if (next < json.size()) out += "\\u003c";
    from = next + 1;
  }
  out += page.substr(at + std::string_view("null").size());
  return out;
}

}  // namespace bslam::report
