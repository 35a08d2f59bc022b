#include "base/atomic_folder.h"

#include <unistd.h>

#include <algorithm>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "base/atomic_file.h"

namespace bslam {
namespace {

namespace fs = std::filesystem;

Error folder_error(const fs::path& place, const std::error_code& error) {
  return {place.string(), "", error.message(), "a folder that can be written",
          "cannot write " + place.string() + ": " + error.message()};
}

// Whether a relative path leads to a file below the folder it is relative to. Links are not followed.
bool is_below(const fs::path& name) {
  const fs::path normal = name.lexically_normal();
  return !name.empty() && normal.is_relative() && normal.has_filename() && normal != "." && *normal.begin() != "..";
}

// Moves files into an existing folder, and can move them back.
class Replacement {
 public:
  // Files of `to` that are replaced are kept in the new folder `aside` until finish().
  Replacement(fs::path from, fs::path to, fs::path aside)
      : from_(std::move(from)), to_(std::move(to)), aside_(std::move(aside)) {}

  // Moves all files below `from` to the same names below `to`, in the order of their names.
  std::error_code move_files() {
    std::error_code error;
    std::vector<fs::path> entries;
    for (fs::recursive_directory_iterator entry(from_, error), end; !error && entry != end; entry.increment(error))
      entries.push_back(entry->path());
    std::ranges::sort(entries);
    for (const fs::path& entry : entries) {
      if (!error) error = move_entry(entry);
    }
    return error;
  }

  // Moves everything back. Returns false if something could not be moved; the replaced files are in `aside` then.
  bool undo() {
    bool all = true;
    std::error_code error;
    for (; !moved_.empty(); moved_.pop_back()) {
      fs::rename(moved_.back().to, moved_.back().from, error);
      all = all && !error;
    }
    for (; !created_.empty(); created_.pop_back()) fs::remove(created_.back(), error);
    if (all) finish();
    return all;
  }

  void finish() const {
    std::error_code ignored;
    fs::remove_all(aside_, ignored);
  }

 private:
  struct Move {
    fs::path from, to;
  };

  std::error_code move(const fs::path& from, const fs::path& to) {
    std::error_code error;
    fs::rename(from, to, error);
    if (!error) moved_.push_back({from, to});
    return error;
  }

  std::error_code move_entry(const fs::path& entry) {
    const fs::path name = entry.lexically_relative(from_), target = to_ / name;
    std::error_code error;
    if (fs::is_directory(entry, error)) {
      if (fs::create_directory(target, error)) created_.push_back(target);
      return error;
    }
    const fs::file_status present = fs::symlink_status(target, error);
    if (fs::is_directory(present)) return std::make_error_code(std::errc::is_a_directory);
    if (fs::exists(present)) {
      fs::create_directories((aside_ / name).parent_path(), error);
      if (error || (error = move(target, aside_ / name))) return error;
    }
    return move(entry, target);
  }

  fs::path from_, to_, aside_;
  std::vector<Move> moved_;
  std::vector<fs::path> created_;
};

}  // namespace

Result<AtomicFolder> AtomicFolder::create(const fs::path& given, bool into_existing) {
  fs::path place = given.has_filename() ? given : given.parent_path();  // without a slash at the end
  std::error_code error;
  if (fs::exists(place, error)) {
    if (!fs::is_directory(place, error)) return Error{place.string(), "--out", "a file", "a folder"};
    if (!fs::is_empty(place, error) && !into_existing)
      return Error{place.string(), "--out", "a folder that is not empty", "an empty or new folder, or --overwrite"};
  }
  if (place.has_parent_path()) fs::create_directories(place.parent_path(), error);
  if (error) return folder_error(place, error);
  if (fs::is_symlink(place, error)) {  // the folder that it leads to is written
    fs::path target = fs::canonical(place, error);
    if (error) return folder_error(place, error);
    place = std::move(target);
  }
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
  if (!is_below(name))
    return Error{(place_ / name).string(), "", "the name of a file outside of the folder",
                 "a name that leads to a file in " + place_.string()};
  const fs::path file = part_ / name.lexically_normal();
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
    fs::path aside = part_;
    aside += "-replaced";
    Replacement replacement(part_, place_, aside);
    const std::error_code failed = replacement.move_files();
    if (!failed) {
      replacement.finish();
      return {};  // the destructor removes the folders that are empty now
    }
    Error reason = folder_error(place_, failed);
    if (!replacement.undo()) reason.sentence += "; the files that were replaced are in " + aside.string();
    return reason;
  }
  fs::rename(part_, place_, error);  // replaces an empty folder
  if (error) return folder_error(place_, error);
  part_.clear();
  return {};
}

}  // namespace bslam
