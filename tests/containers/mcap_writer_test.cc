#include "containers/mcap_writer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>

#include "containers/messages.h"
#include "containers/ros_writer.h"
#include "support/data_on_disk.h"

namespace bslam::containers {
namespace {

constexpr int kWidth = 40, kHeight = 30, kImages = 12;
constexpr TimeNs kStart = 1'700'000'000'000'000'123, kInterval = 50'000'000;

std::string pixels(int seed) {
  std::string out;
  for (int k = 0; k < kWidth * kHeight; ++k) out += static_cast<char>((31 * k + 7 * seed + k * k % 13) % 256);
  return out;
}

std::string message(int k) {
  const std::string data = pixels(k);
  return grey_image_message(kStart + k * kInterval + 7, "left", kWidth, kHeight,
                            reinterpret_cast<const std::uint8_t*>(data.data()), kWidth);
}

// A recording of images in chunks of three, with a JPEG beside each; finished or not.
void write_recording(const std::filesystem::path& path, bool finish) {
  auto writer = McapWriter::create(path);
  ASSERT_TRUE(writer.ok()) << writer.error().message();
  McapWriter& file = **writer;
  ASSERT_TRUE(file.attach("rig.yaml", "application/yaml", "bslam_rig: 1\n").ok());
  ASSERT_TRUE(file.add_metadata("bslam.live", {{"topics", "/left/image_raw"}}).ok());
  const auto left = file.add_topic("/left/image_raw", kImageType, image_definition());
  const auto right = file.add_topic("/right/compressed", kCompressedImageType, compressed_image_definition());
  for (int k = 0; k < kImages; ++k) {
    ASSERT_TRUE(file.write(left, kStart + k * kInterval, message(k)).ok());
    ASSERT_TRUE(file.write(right, kStart + k * kInterval, jpeg_image_message(kStart, "right", "file")).ok());
    EXPECT_TRUE(k % 3 != 2 || file.flush().ok());
  }
  EXPECT_TRUE(!finish || file.finish().ok());
}

// The images that can be read are the first ones, as they were written.
int images_in_order(const MessageFile& file) {
  int count = 0;
  for (const MessageRef& ref : file.messages()) {
    const Topic& topic = file.topics()[ref.topic];
    if (topic.type != "sensor_msgs/Image") continue;
    const auto bytes = file.read(ref, kWholeMessage);
    if (!bytes) continue;
    EXPECT_EQ(*bytes, message(count));
    EXPECT_EQ(ref.received_ns, kStart + count * kInterval);
    ++count;
  }
  return count;
}

TEST(McapWriter, AttachmentsOfAnyNumberAndSizeAreReadByName) {
  const support::TemporaryFolder folder;
  const auto path = folder.path() / "a.mcap";
  auto writer = McapWriter::create(path);
  ASSERT_TRUE(writer.ok()) << writer.error().message();
  const auto bytes = [](int k) { return std::string(k == 19 ? 3'000'000 : 100, static_cast<char>('a' + k)); };
  for (int k = 0; k < 20; ++k)
    ASSERT_TRUE((*writer)->attach("masks/cam" + std::to_string(k) + ".png", "image/png", bytes(k)).ok());
  ASSERT_TRUE((*writer)->flush().ok());
  for (const bool finished : {false, true}) {
    ASSERT_TRUE(!finished || (*writer)->finish().ok());
    for (const int k : {0, 17, 19}) {
      const auto read = read_attachment(path, "masks/cam" + std::to_string(k) + ".png");
      ASSERT_TRUE(read.ok()) << read.error().message();
      EXPECT_TRUE(*read == bytes(k)) << k;
    }
    EXPECT_EQ(read_attachment(path, "masks/cam20.png").error().found, "no attachment masks/cam20.png");
  }
  support::write_text(path, "not a recording");
  EXPECT_EQ(read_attachment(path, "masks/cam0.png").error().expected, "an MCAP file");
}

TEST(McapWriter, IsReadBack) {
  const support::TemporaryFolder folder;
  write_recording(folder.path() / "a.mcap", true);
  const auto file = open_message_file(folder.path() / "a.mcap");
  ASSERT_TRUE(file.ok()) << file.error().message();
  EXPECT_TRUE((*file)->warnings().empty()) << (*file)->warnings().front();
  EXPECT_EQ(images_in_order(**file), kImages);
  ASSERT_EQ((*file)->topics().size(), 2u);
  ASSERT_EQ((*file)->attachments().size(), 1u);
  EXPECT_EQ((*file)->attachments()[0].name, "rig.yaml");
  EXPECT_EQ((*file)->attachments()[0].bytes, "bslam_rig: 1\n");
  EXPECT_EQ((*file)->metadata().at("bslam.live").at("topics"), "/left/image_raw");
  const auto bytes = (*file)->read((*file)->messages().front(), kWholeMessage);
  const auto image = parse_image((*file)->topics()[0], *bytes);
  ASSERT_TRUE(image.has_value());
  EXPECT_EQ(image->stamp_ns, kStart + 7);
  EXPECT_EQ(image->encoding, "mono8");
  EXPECT_EQ(image->width, static_cast<std::uint32_t>(kWidth));
  EXPECT_EQ(bytes->substr(image->data_at), pixels(0));
  const auto ref = std::ranges::find((*file)->messages(), 1u, &MessageRef::topic);
  const auto other = (*file)->read(*ref, kWholeMessage);
  const auto jpeg = parse_image((*file)->topics()[1], *other);
  ASSERT_TRUE(jpeg.has_value());
  EXPECT_EQ(other->substr(jpeg->data_at, jpeg->data_size), "file");
}

TEST(McapWriter, RecordingThatWasCutOffIsReadAsFarAsItGoes) {
  const support::TemporaryFolder folder;
  write_recording(folder.path() / "whole.mcap", false);
  const std::string whole = support::read_text(folder.path() / "whole.mcap");
  int most = 0;
  for (std::size_t size = 40; size <= whole.size(); size += 61) {
    const auto path = folder.path() / "cut.mcap";
    support::write_text(path, whole.substr(0, size));
    const auto file = open_message_file(path);
    const int count = file.ok() ? images_in_order(**file) : 0;
    EXPECT_GE(count, most) << size;
    most = std::max(most, count);
  }
  EXPECT_GT(most, kImages - 4);
  const auto file = open_message_file(folder.path() / "whole.mcap");
  ASSERT_TRUE(file.ok());
  EXPECT_EQ(images_in_order(**file), kImages);
  ASSERT_EQ((*file)->warnings().size(), 1u);
  EXPECT_NE((*file)->warnings()[0].find("was not finished"), std::string::npos);
}

TEST(McapWriter, DamageBeforeTheImagesLosesNoneSilently) {
  const support::TemporaryFolder folder;
  const auto path = folder.path() / "damaged.mcap";
  write_recording(path, true);
  const std::string whole = support::read_text(path);
  const std::size_t end = whole.find("/left/image_raw") + 20;  // of attachment and metadata
  ASSERT_LT(end, 400u);
  int complete = 0, incomplete = 0;
  for (std::size_t at = 8; at < end; ++at) {
    for (const char value : {'\0', '\x7f', '\xff'}) {
      std::string damaged = whole;
      damaged[at] = value;
      support::write_text(path, damaged);
      const auto file = open_message_file(path);
      const bool all = file.ok() && (*file)->messages().size() == 2 * kImages;
      (all ? complete : incomplete) += 1;
      EXPECT_TRUE(all || !file.ok() || !(*file)->warnings().empty()) << at;
    }
  }
  EXPECT_GT(complete, 10 * incomplete);
}

// The kinds of the records of the summary, in order; equal ones in a row once.
std::string kinds_in_summary(const std::string& file) {
  std::uint64_t at = 0, size = 0;
  std::memcpy(&at, file.data() + file.size() - 28, 8);  // the footer ends 8 bytes before the end
  std::string kinds;
  for (; at + 9 <= file.size() - 8; at += 9 + size) {
    if (kinds.empty() || kinds.back() != file[at]) kinds += file[at];
    std::memcpy(&size, file.data() + at + 1, 8);
  }
  return kinds;
}

TEST(McapWriter, TheSummaryIsGroupedByTheKindOfItsRecords) {
  const support::TemporaryFolder folder;
  write_recording(folder.path() / "a.mcap", true);
  // Schema, Channel, ChunkIndex, AttachmentIndex, MetadataIndex, Statistics, Footer
  EXPECT_EQ(kinds_in_summary(support::read_text(folder.path() / "a.mcap")), "\x03\x04\x08\x0a\x0d\x0b\x02");
}

TEST(McapWriter, TimesMayBeZeroButNotNegative) {
  const support::TemporaryFolder folder;
  const auto path = folder.path() / "a.mcap";
  auto writer = *McapWriter::create(path);
  const auto topic = writer->add_topic("/left/image_raw", kImageType, image_definition());
  for (const TimeNs time_ns : {0, 5}) EXPECT_TRUE(writer->write(topic, time_ns, message(0)).ok());
  ASSERT_TRUE(writer->finish().ok());
  const std::string file = support::read_text(path);
  const std::string times = std::string(8, '\0') + '\x05' + std::string(7, '\0');  // at the beginning of the chunk
  EXPECT_EQ(file.substr(file.find('\x06', 8 + 9) + 9, 16), times);

  writer = *McapWriter::create(path);
  ASSERT_EQ(writer->add_topic("/left/image_raw", kImageType, image_definition()), 0);
  EXPECT_EQ(writer->write(0, -1, message(0)).error().message(),
            path.string() + ": found a time before 1970, expected times from 1970 on, as MCAP files contain them");
  EXPECT_FALSE(writer->finish().ok());
}

TEST(McapWriter, ReportsAFullDisk) {
  const auto writer = McapWriter::create("/dev/full");
  ASSERT_FALSE(writer.ok());
  EXPECT_EQ(writer.error().message(), "/dev/full: found No space left on device, expected room for the recording");
  EXPECT_FALSE(McapWriter::create("/nowhere/at/all.mcap").ok());
}

}  // namespace
}  // namespace bslam::containers
