#include <filesystem>

#include "cli/print_message.h"
#include "cli/verbs.h"

namespace bslam::cli {

int report_error(const Error& error) {
  print_message("bslam: {}\n", error.message());
  return kExitBadInput;
}

Status check_new_file(const std::string& file, bool overwrite) {
  std::error_code error;
  if (!overwrite && std::filesystem::exists(file, error))
    return Error{file, "--out", "an existing file", "a new file, or --overwrite"};
  return {};
}

}  // namespace bslam::cli
