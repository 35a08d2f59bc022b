#include "dataset/rosbag2_folder.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <system_error>
#include <utility>

#include "base/atomic_file.h"
#include "containers/message_file.h"
#include "yaml/yaml_map.h"

namespace bslam::dataset {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxMetadataBytes = std::size_t{1} << 24;

// Compares names of numbered files so that bag_9.db3 comes before bag_10.db3.
bool natural_less(const fs::path& a, const fs::path& b) {
  const std::string x = a.filename().string(), y = b.filename().string();
  return x.size() != y.size() ? x.size() < y.size() : x < y;
}

// Recorders that compress whole files add .zstd to their names. Returns the decompressed file beside such a file;
// nullopt if there is none.
std::optional<fs::path> decompressed(const fs::path& file) {
  std::error_code error;
  if (file.extension() != ".zstd") return std::nullopt;
  fs::path plain = file.parent_path() / file.stem();
  return fs::is_regular_file(plain, error) ? std::optional(std::move(plain)) : std::nullopt;
}

std::vector<fs::path> message_files_in(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code error;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    std::error_code unreadable;
    if (containers::has_message_file_name(it->path()) && it->is_regular_file(unreadable) && !decompressed(it->path()))
      files.push_back(it->path());
  }
  std::ranges::sort(files, natural_less);
  return files;
}

// Returns the names in the list relative_file_paths.
Result<std::vector<std::string>> listed_files(const fs::path& metadata) {
  auto text = read_file(metadata, kMaxMetadataBytes);
  if (!text) return text.error();
  const auto document = yaml::YamlMap::parse(metadata, *std::move(text));
  if (!document) return document.error();
  const auto bag = document->map("rosbag2_bagfile_information");
  if (!bag) return bag.error();
  const YAML::Node list = bag->node()["relative_file_paths"];
  std::vector<std::string> names;
  for (std::size_t k = 0; list.IsDefined() && list.IsSequence() && k < list.size(); ++k) {
    if (list[k].IsScalar() && !list[k].Scalar().empty()) names.push_back(list[k].Scalar());
  }
  if (names.empty()) return bag->error("relative_file_paths", "no file", "the files of the bag");
  return names;
}

// The file of a bag that metadata.yaml lists. Only its name is used, since old versions of rosbag2 wrote absolute paths
// on the recording machine.
fs::path file_in(const fs::path& folder, const std::string& name) {
  const fs::path file = folder / fs::path(name).filename();
  return decompressed(file).value_or(file);
}

}  // namespace

Result<BagFiles> files_of_rosbag2(const fs::path& folder) {
  BagFiles out;
  std::error_code error;
  const std::vector<fs::path> present = message_files_in(folder);
  const fs::path metadata = folder / "metadata.yaml";
  if (!fs::exists(metadata, error)) {
    out.files = present;
  } else if (const auto names = listed_files(metadata); !names) {
    out.warnings.push_back(names.error().message() + "; all message files of the folder are read");
    out.files = present;
  } else {
    for (const std::string& name : *names) {
      const fs::path file = file_in(folder, name);
      if (fs::is_regular_file(file, error)) {
        if (std::ranges::find(out.files, file) == out.files.end()) out.files.push_back(file);
      } else {
        out.warnings.push_back(fmt::format("{}: {} is listed but not there", metadata.string(), name));
      }
    }
    for (const fs::path& file : present) {
      if (std::ranges::find(out.files, file) == out.files.end())
        out.warnings.push_back(fmt::format("{} is not listed in metadata.yaml and is not read", file.string()));
    }
  }
  if (out.files.empty()) return Error{folder.string(), "", "no message file", "files *.db3 or *.mcap"};
  return out;
}

}  // namespace bslam::dataset
