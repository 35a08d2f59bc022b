#include "base/mapped_file.h"

#include <gtest/gtest.h>

#include "base/atomic_file.h"
#include "base/shared_array.h"
#include "support/data_on_disk.h"

namespace bslam {
namespace {

TEST(MappedFile, HasTheBytesOfTheFileUntilItsLastCopyIsGone) {
  const support::TemporaryFolder folder;
  const auto path = folder.path() / "file";
  const std::string content(10000, 'x');
  ASSERT_TRUE(write_atomically(path, content + "end"));
  std::shared_ptr<const void> owner;
  std::string_view bytes;
  {
    const auto file = MappedFile::open(path, 1 << 20);
    ASSERT_TRUE(file) << file.error().message();
    owner = file->owner();
    bytes = file->bytes();
    file->release();
  }
  ASSERT_TRUE(write_atomically(path, "another file of this name"));
  EXPECT_EQ(bytes, content + "end");
}

TEST(MappedFile, RejectsWhatIsNoSuchFile) {
  const support::TemporaryFolder folder;
  EXPECT_FALSE(MappedFile::open(folder.path() / "none", 100));
  EXPECT_FALSE(MappedFile::open(folder.path(), 100));
  ASSERT_TRUE(write_atomically(folder.path() / "large", std::string(101, ' ')));
  EXPECT_FALSE(MappedFile::open(folder.path() / "large", 100));
  ASSERT_TRUE(write_atomically(folder.path() / "empty", ""));
  EXPECT_TRUE(MappedFile::open(folder.path() / "empty", 100)->bytes().empty());
}

TEST(SharedArray, KeepsTheOwnerOfBorrowedElements) {
  auto owner = std::make_shared<std::vector<int>>(std::vector<int>{1, 2, 3});
  const std::weak_ptr<std::vector<int>> watched = owner;
  const int* const data = owner->data();
  SharedArray<int> array(std::move(owner), data + 1, 2);
  SharedArray<int> copy = array;
  array = {};
  ASSERT_FALSE(watched.expired());
  EXPECT_EQ(copy[1], 3);
  MemoryCount count;
  EXPECT_EQ(copy.memory_bytes(count), 0u);
  copy = {};
  EXPECT_TRUE(watched.expired());
}

}  // namespace
}  // namespace bslam
