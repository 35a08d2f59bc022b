#include "report/plot_file.h"

#include "base/output_file.h"

namespace bslam::report {

Status check_plot_file(const std::filesystem::path& file, const std::string& asked_by, const char* option,
                       const std::vector<std::filesystem::path>& inputs) {
  const std::string extension = file.extension();
  if (!extension.empty() && extension != ".svg" && extension != ".SVG")
    return Error{asked_by, option, file.string(), "a name that ends in .svg, the format that is written"};
  if (Status input = check_not_input(file, option, inputs); !input) return input;
  return check_output_file(file, option, true, "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<svg ");
}

}  // namespace bslam::report
