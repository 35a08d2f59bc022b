// Writing of whole folders. The files of a written folder appear under their names completely or not at all.
#pragma once

#include <filesystem>
#include <string_view>

#include "base/result.h"

namespace bslam {

// A folder that is filled beside its place and moved there by commit(). Without commit() nothing remains of it.
class AtomicFolder {
 public:
  // Creates the temporary folder. Parents of `place` are created. Errors: `place` is a file; it is a folder that is not
  // empty, unless `into_existing`; a folder cannot be created.
  static Result<AtomicFolder> create(const std::filesystem::path& place, bool into_existing);

  AtomicFolder(AtomicFolder&& other) noexcept;
  AtomicFolder& operator=(AtomicFolder&&) = delete;
  ~AtomicFolder();  // removes what was not committed

  // Writes a file of the folder; folders in `name` are created. Errors: `name` is absolute or leads out of the folder;
  // as write_atomically.
  Status write(const std::filesystem::path& name, std::string_view bytes) const;

  // Moves the folder to its place by one rename. If a folder with files is there, the new files are moved into it one
  // by one, since its other files may not be ours: they remain. After an error, all files of the folder are as before;
  // only if the program is killed meanwhile, some are new and some are old (in a folder beside it, `PLACE.part-*`).
  Status commit();

 private:
  AtomicFolder(std::filesystem::path place, std::filesystem::path part)
      : place_(std::move(place)), part_(std::move(part)) {}
  std::filesystem::path place_, part_;  // `part_` is empty after commit()
};

}  // namespace bslam
