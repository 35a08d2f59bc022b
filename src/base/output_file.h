// Checks of the files that a command is asked to write, before it does its work.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"

namespace bslam {

// Checks whether the file can be written. An existing file is replaced only if `overwrite`, and if it begins with
// `begin` or is empty: the name of another file was a mistake.
Status check_output_file(const std::string& file, const char* option, bool overwrite, std::string_view begin);

// Checks that the file to be written is none of those that the command reads, also under another name. Empty names of
// inputs are ignored.
Status check_not_input(const std::string& file, const char* option, const std::vector<std::filesystem::path>& inputs);

// A file that a command writes, with the option that names it. Without a name it is not written.
struct OutputFile {
  const char* option;
  std::filesystem::path file;
};

// Checks that no two files to be written, which need not exist, are the same one, also under other names.
Status check_distinct(const std::vector<OutputFile>& outputs);

}  // namespace bslam
