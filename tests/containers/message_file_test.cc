#include "containers/message_file.h"

#include <gtest/gtest.h>
#include <sqlite3.h>

#include <algorithm>
#include <fstream>
#include <set>

#include "containers/compression.h"
#include "containers/messages.h"
#include "support/bag_writer.h"
#include "support/data_on_disk.h"

namespace bslam::containers {
namespace {

namespace fs = std::filesystem;
using support::Wire;

constexpr TimeNs kStart = 1'700'000'000'000'000'123;
constexpr TimeNs kInterval = 100'000'000;
constexpr int kImages = 10;

std::string pixels(int seed) {
  std::string out;
  for (int k = 0; k < 12 * 8; ++k) out += static_cast<char>((31 * k + 7 * seed) % 256);
  return out;
}

support::TestImage test_image(int k) { return {kStart + k * kInterval, 12, 8, 12, "mono8", pixels(k), false, "left"}; }

// Two topics of images in turn, and one of a type that is not indexed.
std::vector<support::TestMessage> test_messages(Wire wire) {
  const std::string type = wire == Wire::kProtobuf ? "foxglove.RawImage" : "sensor_msgs/Image";
  std::vector<support::TestMessage> out;
  for (int k = 0; k < kImages; ++k) {
    const TimeNs time_ns = kStart + k * kInterval + 5'000'000;
    out.push_back({"/left/image_raw", type, time_ns, support::image_message(wire, test_image(k))});
    out.push_back({"/imu", "sensor_msgs/Imu", time_ns + 1, std::string(50, 'i')});
    out.push_back({"/right/image_raw", type, time_ns + 2, support::image_message(wire, test_image(100 + k))});
  }
  return out;
}

enum class Format { kRos1, kMcap, kSqlite };

struct Layout {
  const char* name;
  Format format;
  Wire wire;
  support::BagLayout layout = {};
};

void PrintTo(const Layout& layout, std::ostream* out) { *out << layout.name; }

std::string bytes_of(const Layout& l) {
  const auto messages = test_messages(l.wire);
  if (l.format == Format::kRos1) return support::rosbag1_bytes(messages, l.layout);
  if (l.format == Format::kMcap) return support::mcap_bytes(messages, l.wire, l.layout);
  const support::TemporaryFolder folder;
  support::write_sqlite_bag(folder.path() / "bag", messages, l.layout.compression == "zstd");
  return support::read_text(folder.path() / "bag");
}

class MessageFileOf : public testing::TestWithParam<Layout> {
 protected:
  MessageFileResult open(const std::string& bytes) const {
    support::write_text(file(), bytes);
    return open_message_file(file());
  }
  fs::path file() const { return folder_.path() / "recording"; }

  // Returns how many images of a topic are read as they were written; expects the others to be errors.
  static int good_images(const MessageFile& file, const std::string& topic, int first) {
    int good = 0;
    for (const MessageRef& message : file.messages()) {
      const Topic& from = file.topics()[message.topic];
      if (from.name != topic) continue;
      const auto bytes = file.read(message, kWholeMessage);
      const auto image = bytes ? parse_image(from, *bytes) : std::nullopt;
      if (!image) continue;
      if (image->data_at > bytes->size()) continue;
      const auto k = static_cast<int>((image->stamp_ns - kStart) / kInterval);
      if (bytes->substr(image->data_at, image->data_size) != pixels(k)) continue;
      ++good;
      EXPECT_EQ(image->stamp_ns, test_image(k).stamp_ns);
      EXPECT_EQ(message.received_ns, kStart + (k - first) * kInterval + 5'000'000 + (first > 0 ? 2 : 0));
    }
    return good;
  }

  support::TemporaryFolder folder_;
};

TEST_P(MessageFileOf, ReadsTopicsAndImages) {
  const auto file = open(bytes_of(GetParam()));
  ASSERT_TRUE(file) << file.error().message();
  ASSERT_EQ((*file)->topics().size(), 3u);
  for (const Topic& topic : (*file)->topics()) {
    EXPECT_EQ(topic.count, static_cast<std::uint64_t>(kImages)) << topic.name;
    EXPECT_EQ(topic.last_ns - topic.first_ns, (kImages - 1) * kInterval) << topic.name;
  }
  EXPECT_EQ((*file)->messages().size(), 2u * kImages);
  EXPECT_EQ((*file)->warnings().empty(), GetParam().layout.index) << (*file)->warnings().front();
  EXPECT_EQ(good_images(**file, "/left/image_raw", 0), kImages);
  EXPECT_EQ(good_images(**file, "/right/image_raw", 100), kImages);
}

TEST_P(MessageFileOf, ReadsTheBeginningOfAMessage) {
  const auto file = open(bytes_of(GetParam()));
  ASSERT_TRUE(file);
  const auto start = (*file)->read((*file)->messages().front(), 80);
  ASSERT_TRUE(start) << start.error().message();
  const auto image = parse_image((*file)->topics()[(*file)->messages().front().topic], *start);
  ASSERT_TRUE(image);
  EXPECT_EQ(image->stamp_ns, kStart);
  EXPECT_EQ(image->width, 12u);
  EXPECT_EQ(image->height, 8u);
  EXPECT_EQ(image->encoding, "mono8");
  EXPECT_EQ(image->step, 12u);
  EXPECT_EQ(image->data_size, 96u);
}

// Whatever is cut off, all before it is read, and what is missing is said.
TEST_P(MessageFileOf, ReadsACutFileAsFarAsItGoes) {
  const std::string bytes = bytes_of(GetParam());
  int last = 0;
  for (std::size_t size = 0; size < bytes.size(); size += 397) {
    const auto file = open(bytes.substr(0, size));
    if (!file) continue;
    const int good = good_images(**file, "/left/image_raw", 0);
    EXPECT_GE(good + 4, last) << size;  // a chunk whose end is missing may be lost
    last = good;
    EXPECT_FALSE((*file)->warnings().empty() && good < kImages) << size;
  }
  EXPECT_TRUE(GetParam().format == Format::kSqlite || last == kImages) << last;
}

// A chunk with an index of which any one record is damaged is read itself: its messages are neither lost nor twice.
TEST_P(MessageFileOf, NoMessageIsLostByADamagedIndexOfAChunk) {
  if (GetParam().format == Format::kSqlite || !GetParam().layout.index) GTEST_SKIP() << "no index of a chunk";
  const std::string bytes = bytes_of(GetParam());
  const bool ros1 = GetParam().format == Format::kRos1;
  // The index of a connection in a ROS 1 bag has the fields conn and count; records of MCAP files with 2 and 1 entries.
  const std::string two("\x07\x26\0\0\0\0\0\0\0", 9), one("\x07\x16\0\0\0\0\0\0\0", 9);
  int damaged = 0;
  for (std::size_t at = 0; at < bytes.size(); ++at) {
    const std::string_view here = std::string_view(bytes).substr(at);
    const bool is_index = ros1 ? here.starts_with("count=") && bytes.compare(at - 13, 5, "conn=") == 0
                               : here.starts_with(two) || here.starts_with(one);
    if (!is_index) continue;
    std::string wrong = bytes;
    wrong[ros1 ? at + 6 : at + 11] = '\x77';  // the count of entries, or their size in bytes
    const auto file = open(wrong);
    ASSERT_TRUE(file) << file.error().message();
    ++damaged;
    EXPECT_FALSE((*file)->warnings().empty()) << at;
    EXPECT_EQ((*file)->messages().size(), 2u * kImages) << at;
    EXPECT_EQ(good_images(**file, "/left/image_raw", 0), kImages) << at;
    EXPECT_EQ(good_images(**file, "/right/image_raw", 100), kImages) << at;
  }
  EXPECT_TRUE(GetParam().layout.messages_per_chunk == 0 || damaged >= 8) << damaged;
}

// Every byte may be wrong: nothing crashes, and no more images are found than there are.
TEST_P(MessageFileOf, HandlesDamagedBytes) {
  const std::string bytes = bytes_of(GetParam());
  for (std::size_t at = 0; at < bytes.size(); at += 211) {
    std::string damaged = bytes;
    damaged[at] = static_cast<char>(damaged[at] ^ 0xff);
    const auto file = open(damaged);
    if (!file) continue;
    for (const MessageRef& message : (*file)->messages()) {
      const auto read = (*file)->read(message, kWholeMessage);
      if (read) static_cast<void>(parse_image((*file)->topics()[message.topic], *read));
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Formats, MessageFileOf,
                         testing::Values(Layout{"Ros1", Format::kRos1, Wire::kRos1},
                                         Layout{"Ros1Bz2", Format::kRos1, Wire::kRos1, {"bz2"}},
                                         Layout{"Ros1Lz4", Format::kRos1, Wire::kRos1, {"lz4"}},
                                         Layout{"Ros1WithoutIndex", Format::kRos1, Wire::kRos1, {"", 4, false}},
                                         Layout{"Ros1Lz4WithoutIndex", Format::kRos1, Wire::kRos1, {"lz4", 4, false}},
                                         Layout{"Mcap", Format::kMcap, Wire::kCdr},
                                         Layout{"McapRos1", Format::kMcap, Wire::kRos1},
                                         Layout{"McapBigEndian", Format::kMcap, Wire::kCdrBigEndian},
                                         Layout{"McapLz4", Format::kMcap, Wire::kCdr, {"lz4"}},
                                         Layout{"McapZstdProtobuf", Format::kMcap, Wire::kProtobuf, {"zstd"}},
                                         Layout{"McapWithoutChunks", Format::kMcap, Wire::kProtobuf, {"", 0}},
                                         Layout{"McapWithoutIndex", Format::kMcap, Wire::kCdr, {"zstd", 4, false}},
                                         Layout{"Sqlite", Format::kSqlite, Wire::kCdr},
                                         Layout{"SqliteZstd", Format::kSqlite, Wire::kCdr, {"zstd"}}),
                         [](const auto& instance) { return std::string(instance.param.name); });

TEST(MessageFile, AWrongChecksumIsAnErrorOfItsMessages) {
  const support::TemporaryFolder folder;
  std::string bytes = support::mcap_bytes(test_messages(Wire::kCdr), Wire::kCdr);
  const std::size_t at = bytes.find(pixels(1));
  ASSERT_NE(at, std::string::npos);
  bytes[at] = static_cast<char>(bytes[at] + 1);
  support::write_text(folder.path() / "a.mcap", bytes);
  const auto file = open_message_file(folder.path() / "a.mcap");
  ASSERT_TRUE(file);
  int wrong = 0;
  for (const MessageRef& message : (*file)->messages()) wrong += !(*file)->read(message, kWholeMessage).ok();
  EXPECT_GE(wrong, 1);
  EXPECT_LE(wrong, 4);  // those of one chunk
}

// Sizes in a file reserve no memory that its content does not fill.
TEST(MessageFile, AbsurdSizesAreNotBelieved) {
  const support::TemporaryFolder folder;
  std::string bytes = support::rosbag1_bytes(test_messages(Wire::kRos1), {"lz4"});
  for (std::size_t at = bytes.find("size="); at != std::string::npos; at = bytes.find("size=", at + 1))
    bytes.replace(at + 5, 4, "\xff\xff\xff\xff");
  support::write_text(folder.path() / "a.bag", bytes);
  const auto file = open_message_file(folder.path() / "a.bag");
  ASSERT_TRUE(file) << file.error().message();
  EXPECT_EQ((*file)->messages().size(), 2u * kImages);
  for (const MessageRef& message : (*file)->messages()) EXPECT_TRUE((*file)->read(message, kWholeMessage));
}

// A length up to the end of a large file, as one wrong byte makes it.
TEST(MessageFile, AMessageOfAbsurdLengthIsDamagedAndReservesNoMemory) {
  const support::TemporaryFolder folder;
  const fs::path path = folder.path() / "a.mcap";
  const auto messages = test_messages(Wire::kCdr);
  std::string bytes = support::mcap_bytes(messages, Wire::kCdr, {"", 0, false});
  const std::size_t data = bytes.find(messages.back().bytes);
  ASSERT_NE(data, std::string::npos);
  constexpr std::size_t kMessageHead = 22, kLength = 8;
  const std::size_t length = data - kMessageHead - kLength;
  ASSERT_EQ(bytes[length - 1], 5);  // a message
  bytes.resize(data + messages.back().bytes.size());
  bytes[length + 3] = '\x60';  // 1.5 GiB
  support::write_text(path, bytes);
  fs::resize_file(path, std::uintmax_t{1} << 31);
  const auto file = open_message_file(path);
  ASSERT_TRUE(file) << file.error().message();
  ASSERT_EQ((*file)->messages().size(), 2u * kImages);
  EXPECT_TRUE((*file)->read((*file)->messages().back(), 80));
  const auto whole = (*file)->read((*file)->messages().back(), kWholeMessage);
  ASSERT_FALSE(whole);
  EXPECT_EQ(whole.error().found, "a message that is damaged or cut off");
  EXPECT_TRUE((*file)->read((*file)->messages().front(), kWholeMessage));
}

TEST(MessageFile, ASqliteMessageCannotBeLargerThanItsFile) {
  const support::TemporaryFolder folder;
  const fs::path bag = folder.path() / "a.db3";
  support::write_sqlite_bag(bag, {{"/image", "sensor_msgs/Image", kStart, std::string(20'000, 'x')}});
  std::string bytes = support::read_text(bag);
  // The header of the row: its own size, id, topic_id, timestamp, and the size of the data, times 2 and 12 more, in
  // groups of 7 bits. Before it are the size of the row and its number.
  const std::string header("\x07\0\x09\x06\x82\xb8\x4c", 7);
  const std::size_t at = bytes.find(header);
  ASSERT_NE(at, std::string::npos);
  bytes.replace(at + 4, 3, "\xff\xff\x7c");
  bytes.replace(at - 4, 3, "\xc0\x80\x07");
  support::write_text(bag, bytes);
  const auto file = open_message_file(bag);
  ASSERT_TRUE(file) << file.error().message();
  ASSERT_EQ((*file)->messages().size(), 1u);
  for (const std::size_t size : {std::size_t{512}, kWholeMessage}) {
    const auto read = (*file)->read((*file)->messages().front(), size);
    ASSERT_FALSE(read);
    EXPECT_TRUE(read.error().found.starts_with("a message of 1048568 bytes in a file of")) << read.error().found;
  }
}

// As scripts name files that join a folder with a slash at its end.
TEST(MessageFile, AnSqliteBagMayBeNamedWithTwoSlashes) {
  const support::TemporaryFolder folder;
  support::write_sqlite_bag(folder.path() / "a.db3", test_messages(Wire::kCdr));
  const auto file = open_message_file("/" + (folder.path() / "a.db3").string());
  ASSERT_TRUE(file) << file.error().message();
  EXPECT_FALSE((*file)->messages().empty());
}

TEST(MessageFile, NothingIsWrittenBesideAnSqliteBagWithALog) {
  const support::TemporaryFolder folder;
  const fs::path recorded = folder.path() / "recorded", copy = folder.path() / "copy";
  fs::create_directories(recorded);
  fs::create_directories(copy);
  support::write_sqlite_bag(recorded / "a.db3", test_messages(Wire::kCdr));
  sqlite3* recorder = nullptr;
  ASSERT_EQ(sqlite3_open((recorded / "a.db3").c_str(), &recorder), SQLITE_OK);
  EXPECT_EQ(sqlite3_exec(recorder,
                         "PRAGMA journal_mode=WAL; INSERT INTO messages(topic_id, timestamp, data) SELECT topic_id, "
                         "timestamp, data FROM messages WHERE id = 1;",
                         nullptr, nullptr, nullptr),
            SQLITE_OK);
  fs::copy_file(recorded / "a.db3", copy / "a.db3");  // as if the recorder was killed now
  fs::copy_file(recorded / "a.db3-wal", copy / "a.db3-wal");
  sqlite3_close(recorder);
  const auto file = open_message_file(copy / "a.db3");
  ASSERT_TRUE(file) << file.error().message();
  ASSERT_EQ((*file)->messages().size(), 2u * kImages);
  for (const MessageRef& message : (*file)->messages()) EXPECT_TRUE((*file)->read(message, kWholeMessage));
  ASSERT_EQ((*file)->warnings().size(), 1u);
  EXPECT_NE((*file)->warnings()[0].find("a.db3-wal, which is not read"), std::string::npos) << (*file)->warnings()[0];
  std::set<std::string> names;
  for (const auto& entry : fs::directory_iterator(copy)) names.insert(entry.path().filename());
  EXPECT_EQ(names, (std::set<std::string>{"a.db3", "a.db3-wal"}));
}

TEST(MessageFile, RejectsOtherFiles) {
  const support::TemporaryFolder folder;
  const auto found = [&](const std::string& bytes) {
    support::write_text(folder.path() / "a", bytes);
    const auto file = open_message_file(folder.path() / "a");
    return file ? std::string("none") : file.error().found;
  };
  EXPECT_EQ(found(""), "an empty file");
  EXPECT_EQ(found("hello"), "a file of another format");
  EXPECT_EQ(found("#ROSBAG V1.2\n"), "a bag of another version");
  EXPECT_EQ(found(std::string("\x28\xb5\x2f\xfd") + "rest"), "a compressed file");
  EXPECT_EQ(found("SQLite format 3"), "file is not a database");
  EXPECT_FALSE(open_message_file(folder.path()));
  EXPECT_FALSE(open_message_file(folder.path() / "missing"));
}

TEST(Compression, StopsAtTheLimit) {
  EXPECT_EQ(compression_named("lz4"), Compression::kLz4);
  EXPECT_EQ(compression_named(""), Compression::kNone);
  EXPECT_FALSE(compression_named("gzip"));
  EXPECT_EQ(decompress(Compression::kNone, "abcdef", 3), "abc");
  EXPECT_EQ(decompress(Compression::kBz2, "no bz2", 100), "");
  EXPECT_EQ(decompress(Compression::kLz4, "no lz4", 100), "");
  EXPECT_EQ(decompress(Compression::kZstd, "no zstd", 100), "");
  // A few bytes may stand for very many.
  const std::string zeros(std::size_t{1} << 22, '\0');
  for (const auto& [name, compression] : {std::pair("bz2", Compression::kBz2), std::pair("lz4", Compression::kLz4),
                                          std::pair("zstd", Compression::kZstd)}) {
    const std::string packed = support::compress(name, zeros);
    EXPECT_LT(packed.size(), zeros.size() / 100) << name;
    for (const std::size_t limit : {std::size_t{1}, std::size_t{1000}, std::size_t{100'000}}) {
      const std::string out = decompress(compression, packed, limit);
      EXPECT_EQ(out, zeros.substr(0, limit)) << name;
      EXPECT_LE(out.capacity(), 2 * limit + 64) << name;
    }
    EXPECT_EQ(decompress(compression, packed, 2 * zeros.size()), zeros) << name;
  }
}

TEST(Messages, ReadsCalibrations) {
  support::TestCalibration c{640, 480, "rational_polynomial", {1, 2, 3, 4, 5, 6, 7, 8}, {}, {}, {}};
  for (int k = 0; k < 9; ++k) c.K.push_back(k), c.R.push_back(10 + k);
  for (int k = 0; k < 12; ++k) c.P.push_back(20 + k);
  for (const auto& [wire, serialisation] :
       {std::pair(Wire::kRos1, Serialisation::kRos1), std::pair(Wire::kCdr, Serialisation::kCdr),
        std::pair(Wire::kCdrBigEndian, Serialisation::kCdr), std::pair(Wire::kProtobuf, Serialisation::kProtobuf)}) {
    const Topic topic{"/info", wire == Wire::kProtobuf ? "foxglove/CameraCalibration" : "sensor_msgs/CameraInfo", "",
                      serialisation};
    const std::string bytes = support::calibration_message(wire, c);
    const auto info = parse_camera_info(topic, bytes);
    ASSERT_TRUE(info);
    EXPECT_EQ(info->width, 640u);
    EXPECT_EQ(info->height, 480u);
    EXPECT_EQ(info->distortion_model, "rational_polynomial");
    EXPECT_EQ(info->distortion, c.D);
    EXPECT_TRUE(std::ranges::equal(info->K, c.K));
    EXPECT_TRUE(std::ranges::equal(info->R, c.R));
    EXPECT_TRUE(std::ranges::equal(info->P, c.P));
    EXPECT_TRUE(wire == Wire::kProtobuf || !parse_camera_info(topic, bytes.substr(0, bytes.size() / 2)));
  }
}

TEST(Messages, TypesOfRos2AndFoxgloveAreThoseOfRos1) {
  EXPECT_EQ(plain_type("sensor_msgs/msg/Image"), "sensor_msgs/Image");
  EXPECT_EQ(plain_type("foxglove.RawImage"), "foxglove/RawImage");
  EXPECT_EQ(plain_type("sensor_msgs/Image"), "sensor_msgs/Image");
}

}  // namespace
}  // namespace bslam::containers
