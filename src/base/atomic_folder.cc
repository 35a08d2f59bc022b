#include "base/atomic_folder.h"

#include <unistd.h>

#include <string>
#include <system_error>
#include <utility>

#include "base/atomic_file.h"

namespace bslam {
namespace {

namespace fs = std::filesystem;

Error folder_error(const fs::path& place, const std::error_code& error) {
  return {place.string(), "", error.message(), "a folder that can be written",
          "cannot write " + place.string() + ": " + error.message()};
}

// Moves all files below `from` to the same names below `to`.
std::error_code move_files(const fs::path& from, const fs::path& to) {
  std::error_code error;
  for (fs::recursive_directory_iterator entry(from, error), end; !error && entry != end; entry.increment(error)) {
    const fs::path target = to / entry->path().lexically_relative(from);
    if (entry->is_directory(error)) {
      fs::create_directories(target, error);
    } else {
      fs::rename(entry->path(), target, error);
    }
    if (error) return error;
  }
  return error;
}

}  // namespace

Result<AtomicFolder> AtomicFolder::create(const fs::path& given, bool into_existing) {
  const fs::path place = given.has_filename() ? given : given.parent_path();  // without a slash at the end
  std::error_code error;
  if (fs::exists(place, error)) {
    if (!fs::is_directory(place, error)) return Error{place.string(), "--out", "a file", "a folder"};
    if (!fs::is_empty(place, error) && !into_existing)
      return Error{place.string(), "--out", "a folder that is not empty", "an empty or new folder, or --overwrite"};
  }
  if (place.has_parent_path()) fs::create_directories(place.parent_path(), error);
  if (error) return folder_error(place, error);
  for (int attempt = 0;; ++attempt) {
    fs::path part = place;
    part += ".part-" + std::to_string(::getpid()) + "-" + std::to_string(attempt);
    if (fs::create_directory(part, error)) return AtomicFolder(place, part);
    if (error) return folder_error(place, error);
  }
}

AtomicFolder::AtomicFolder(AtomicFolder&& other) noexcept
    : place_(std::move(other.place_)), part_(std::exchange(other.part_, {})) {}

AtomicFolder::~AtomicFolder() {
  std::error_code ignored;
  if (!part_.empty()) fs::remove_all(part_, ignored);
}

Status AtomicFolder::write(const fs::path& name, std::string_view bytes) const {
  const fs::path file = part_ / name;
  std::error_code error;
  fs::create_directories(file.parent_path(), error);
  if (error) return folder_error(place_ / name, error);
  Status status = write_atomically(file, bytes);
  if (status) return status;
  const std::string& reason = status.error().found;
  return Error{(place_ / name).string(), "", reason, status.error().expected,
               "cannot write " + (place_ / name).string() + ": " + reason};
}

Status AtomicFolder::commit() {
  std::error_code error;
  if (fs::is_directory(place_, error) && !fs::is_empty(place_, error)) {
    if (const std::error_code failed = move_files(part_, place_)) return folder_error(place_, failed);
    return {};  // the destructor removes the folders that are empty now
  }
  fs::rename(part_, place_, error);  // replaces an empty folder
  if (error) return folder_error(place_, error);
  part_.clear();
  return {};
}

}  // namespace bslam
