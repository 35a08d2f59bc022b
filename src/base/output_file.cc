#include "base/output_file.h"

#include <algorithm>
#include <fstream>
#include <map>
#include <system_error>

#include "base/atomic_file.h"
#include "base/behind_links.h"

namespace bslam {
namespace {

bool begins_with(const std::filesystem::path& file, std::string_view text) {
  std::string begin(text.size(), '\0');
  std::ifstream stream(file, std::ios::binary);
  stream.read(begin.data(), static_cast<std::streamsize>(begin.size()));
  return stream.gcount() == 0 || begin.substr(0, static_cast<std::size_t>(stream.gcount())) == text;
}

// The name of a file that may not exist, without links.
std::filesystem::path real_name(const std::filesystem::path& file) {
  std::error_code error;
  const std::filesystem::path end = behind_links(std::filesystem::absolute(file), error);
  const std::filesystem::path real = std::filesystem::weakly_canonical(end, error);
  return error ? end.lexically_normal() : real;
}

}  // namespace

Status check_output_file(const std::string& file, const char* option, bool overwrite, std::string_view begin) {
  if (file.empty()) return {};
  std::error_code error;
  const std::filesystem::path path(file), folder = path.has_parent_path() ? path.parent_path() : ".";
  if (std::filesystem::is_directory(path, error)) return Error{file, option, "a folder", "the name of a file"};
  if (!std::filesystem::is_directory(folder, error))
    return Error{folder.string(), option, "no such folder", "an existing folder"};
  if (std::filesystem::is_regular_file(path, error) && !overwrite)
    return Error{file, option, "an existing file", "a new name, or --overwrite"};
  if (std::filesystem::is_regular_file(path, error) && !begins_with(path, begin))
    return Error{file, option, "an existing file of another kind",
                 "a new name, or that of a file of the kind that is written"};
  return check_writable(path);
}

Status check_not_input(const std::string& file, const char* option, const std::vector<std::filesystem::path>& inputs) {
  const auto is_file = [&file](const std::filesystem::path& input) {
    std::error_code error;
    return !input.empty() && std::filesystem::equivalent(file, input, error);
  };
  if (std::ranges::none_of(inputs, is_file)) return {};
  return Error{file, option, "a file that this command reads", "another name"};
}

Status check_distinct(const std::vector<OutputFile>& outputs) {
  std::map<std::filesystem::path, const char*> options;
  for (const OutputFile& output : outputs) {
    if (output.file.empty()) continue;
    const auto [same, is_new] = options.try_emplace(real_name(output.file), output.option);
    if (!is_new)
      return Error{output.file.string(), output.option, std::string("the file of ") + same->second, "another name"};
  }
  return {};
}

}  // namespace bslam
