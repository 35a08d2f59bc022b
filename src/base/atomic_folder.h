// Writing of whole folders. The files of a written folder appear under their names completely or not at all.
#pragma once

#include <filesystem>
#include <string_view>

#include "base/result.h"

namespace bslam {

// A folder that is written under a temporary name next to its destination `place` and renamed by commit(). Without
// commit() nothing remains of it.
class AtomicFolder {
 public:
  // Creates the temporary folder. Parents of `place` are created; if it is a link, the folder that it leads to is
  // written. Errors: `place` is a file, or a link that leads nowhere; it is a folder that is not empty, unless
  // `into_existing`; a folder cannot be created.
  static Result<AtomicFolder> create(const std::filesystem::path& place, bool into_existing);

  AtomicFolder(AtomicFolder&& other) noexcept;
  AtomicFolder& operator=(AtomicFolder&&) = delete;
  ~AtomicFolder();  // removes the temporary folder if it was not committed

  // Writes a file of the folder; folders in `name` are created. Errors: `name` is absolute or leads out of the folder;
  // those of write_atomically.
  Status write(const std::filesystem::path& name, std::string_view bytes) const;

  // Moves the folder to its place by one rename. If the destination is a folder with files, the new files are moved
  // into it one by one and its other files remain. After an error, all files of the folder are as before, unless
  // a file cannot be moved back: then some files are new, and the error names the folder with the replaced ones. If the
  // program is killed during the move, some files can be new as well and the replaced ones be in `PLACE.part-*` next to
  // the folder.
  Status commit();

 private:
  AtomicFolder(std::filesystem::path place, std::filesystem::path part)
      : place_(std::move(place)), part_(std::move(part)) {}
  std::filesystem::path place_, part_;  // `part_` is empty after commit()
};

}  // namespace bslam
