#include "support/bag_writer.h"

#include <bzlib.h>
#include <libdeflate.h>
#include <lz4frame.h>
#include <sqlite3.h>
#include <zstd.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <map>
#include <set>
#include <utility>

namespace bslam::support {
namespace {

// Appends numbers and strings; those of CDR aligned to their size.
class Writer {
 public:
  explicit Writer(Wire wire) : wire_(wire) {
    if (wire == Wire::kCdr) out_ = std::string("\0\1\0\0", 4);
    if (wire == Wire::kCdrBigEndian) out_ = std::string("\0\0\0\0", 4);
    start_ = out_.size();
  }
  template <class T>
  void number(T value) {
    while (is_cdr() && (out_.size() - start_) % sizeof(T) != 0) out_ += '\0';
    char raw[sizeof(T)];
    std::memcpy(raw, &value, sizeof(T));
    if ((wire_ == Wire::kCdrBigEndian) != (std::endian::native == std::endian::big)) std::reverse(raw, raw + sizeof(T));
    out_.append(raw, sizeof(T));
  }
  void text(const std::string& value) {
    number(static_cast<std::uint32_t>(value.size() + (is_cdr() ? 1 : 0)));
    out_ += value;
    if (is_cdr()) out_ += '\0';
  }
  void data(const std::string& value) {
    number(static_cast<std::uint32_t>(value.size()));
    out_ += value;
  }
  void header(TimeNs stamp_ns, const std::string& frame_id) {
    if (wire_ == Wire::kRos1) number<std::uint32_t>(7);
    number(static_cast<std::uint32_t>(stamp_ns / 1'000'000'000));
    number(static_cast<std::uint32_t>(stamp_ns % 1'000'000'000));
    text(frame_id);
  }
  std::string take() { return std::move(out_); }

 private:
  bool is_cdr() const { return wire_ == Wire::kCdr || wire_ == Wire::kCdrBigEndian; }
  Wire wire_;
  std::string out_;
  std::size_t start_ = 0;
};

template <class T>
std::string raw(T value) {
  Writer out(Wire::kRos1);
  out.number(value);
  return out.take();
}

std::string counted(const std::string& bytes) { return raw(static_cast<std::uint32_t>(bytes.size())) + bytes; }

std::string varint(std::uint64_t value) {
  std::string out;
  for (; value >= 0x80; value >>= 7) out += static_cast<char>(value | 0x80);
  return out + static_cast<char>(value);
}
std::string key(int number, int wire) { return varint(static_cast<std::uint64_t>(number << 3 | wire)); }
std::string bytes_field(int number, const std::string& bytes) { return key(number, 2) + varint(bytes.size()) + bytes; }
std::string fixed_field(int number, std::uint32_t value) { return key(number, 5) + raw(value); }
std::string time_field(TimeNs stamp_ns) {
  return bytes_field(1, key(1, 0) + varint(static_cast<std::uint64_t>(stamp_ns / 1'000'000'000)) + key(2, 0) +
                            varint(static_cast<std::uint64_t>(stamp_ns % 1'000'000'000)));
}
std::string packed_field(int number, const std::vector<double>& values) {
  std::string bytes;
  for (const double value : values) bytes += raw(value);
  return bytes_field(number, bytes);
}

std::string ros2_type(const std::string& type) {
  const std::size_t slash = type.find('/');
  return type.substr(0, slash) + "/msg" + type.substr(slash);
}

using Fields = std::vector<std::pair<std::string, std::string>>;

// A record of a ROS 1 bag.
std::string record1(unsigned char op, const Fields& fields, const std::string& data) {
  std::string header = counted("op=" + std::string(1, static_cast<char>(op)));
  for (const auto& [name, value] : fields) header += counted(name + "=" + value);
  return counted(header) + counted(data);
}

std::string time1(TimeNs time_ns) {
  return raw(static_cast<std::uint32_t>(time_ns / 1'000'000'000)) +
         raw(static_cast<std::uint32_t>(time_ns % 1'000'000'000));
}

std::string connection1(std::uint32_t number, const TestMessage& message) {
  const std::string data = counted("topic=" + message.topic) + counted("type=" + message.type) + counted("md5sum=*") +
                           counted("message_definition=");
  return record1(7, {{"conn", raw(number)}, {"topic", message.topic}}, data);
}

// A record of an MCAP file.
std::string record2(unsigned char op, const std::string& data) {
  return std::string(1, static_cast<char>(op)) + raw(static_cast<std::uint64_t>(data.size())) + data;
}

// The numbers of topics, in the order of their first messages.
std::vector<const TestMessage*> first_of_topics(const std::vector<TestMessage>& messages) {
  std::vector<const TestMessage*> out;
  for (const TestMessage& message : messages) {
    const bool known = std::ranges::any_of(out, [&](const TestMessage* m) { return m->topic == message.topic; });
    if (!known) out.push_back(&message);
  }
  return out;
}

std::size_t topic_number(const std::vector<const TestMessage*>& topics, const TestMessage& message) {
  return static_cast<std::size_t>(
      std::ranges::find_if(topics, [&](const TestMessage* m) { return m->topic == message.topic; }) - topics.begin());
}

}  // namespace

std::string compress(const std::string& name, const std::string& bytes) {
  if (name == "bz2") {
    std::string out(bytes.size() + bytes.size() / 50 + 1000, '\0');
    auto size = static_cast<unsigned>(out.size());
    BZ2_bzBuffToBuffCompress(out.data(), &size, const_cast<char*>(bytes.data()), static_cast<unsigned>(bytes.size()), 1,
                             0, 0);
    return out.substr(0, size);
  }
  if (name == "lz4") {
    std::string out(LZ4F_compressFrameBound(bytes.size(), nullptr), '\0');
    out.resize(LZ4F_compressFrame(out.data(), out.size(), bytes.data(), bytes.size(), nullptr));
    return out;
  }
  if (name == "zstd") {
    std::string out(ZSTD_compressBound(bytes.size()), '\0');
    out.resize(ZSTD_compress(out.data(), out.size(), bytes.data(), bytes.size(), 1));
    return out;
  }
  return bytes;
}

std::string image_message(Wire wire, const TestImage& image) {
  if (wire == Wire::kProtobuf) {
    return time_field(image.stamp_ns) + fixed_field(2, image.width) + fixed_field(3, image.height) +
           bytes_field(4, image.encoding) + fixed_field(5, image.step) + bytes_field(6, image.data) +
           bytes_field(7, image.frame_id);
  }
  Writer out(wire);
  out.header(image.stamp_ns, image.frame_id);
  out.number(image.height);
  out.number(image.width);
  out.text(image.encoding);
  out.number(static_cast<std::uint8_t>(image.big_endian));
  out.number(image.step);
  out.data(image.data);
  return out.take();
}

std::string compressed_image_message(Wire wire, const TestImage& image) {
  if (wire == Wire::kProtobuf) {
    return time_field(image.stamp_ns) + bytes_field(2, image.data) + bytes_field(3, image.encoding) +
           bytes_field(4, image.frame_id);
  }
  Writer out(wire);
  out.header(image.stamp_ns, image.frame_id);
  out.text(image.encoding);
  out.data(image.data);
  return out.take();
}

std::string calibration_message(Wire wire, const TestCalibration& c) {
  if (wire == Wire::kProtobuf) {
    return time_field(1) + fixed_field(2, c.width) + fixed_field(3, c.height) + bytes_field(4, c.model) +
           packed_field(5, c.D) + packed_field(6, c.K) + packed_field(7, c.R) + packed_field(8, c.P);
  }
  Writer out(wire);
  out.header(1, "camera");
  out.number(c.height);
  out.number(c.width);
  out.text(c.model);
  out.number(static_cast<std::uint32_t>(c.D.size()));
  for (const auto* values : {&c.D, &c.K, &c.R, &c.P}) {
    for (const double value : *values) out.number(value);
  }
  for (int k = 0; k < 6; ++k) out.number<std::uint32_t>(0);  // binning and region of interest
  out.number<std::uint8_t>(0);
  return out.take();
}

std::string rosbag1_bytes(const std::vector<TestMessage>& messages, const BagLayout& layout) {
  const auto topics = first_of_topics(messages);
  constexpr std::size_t kHeaderBytes = 4096;
  std::string body, infos;
  std::set<std::size_t> described;
  const std::string start = "#ROSBAG V2.0\n";
  std::uint32_t chunks = 0;
  for (std::size_t from = 0; from < messages.size(); from += layout.messages_per_chunk, ++chunks) {
    const std::size_t to = std::min(messages.size(), from + layout.messages_per_chunk);
    std::string chunk;
    std::map<std::size_t, std::string> index;
    for (std::size_t k = from; k < to; ++k) {
      const std::size_t topic = topic_number(topics, messages[k]);
      const auto number = static_cast<std::uint32_t>(topic);
      if (described.insert(topic).second) chunk += connection1(number, messages[k]);
      index[topic] += time1(messages[k].time_ns) + raw(static_cast<std::uint32_t>(chunk.size()));
      chunk += record1(2, {{"conn", raw(number)}, {"time", time1(messages[k].time_ns)}}, messages[k].bytes);
    }
    const std::uint64_t at = start.size() + kHeaderBytes + body.size();
    const std::string name = layout.compression.empty() ? "none" : layout.compression;
    body += record1(5, {{"compression", name}, {"size", raw(static_cast<std::uint32_t>(chunk.size()))}},
                    compress(layout.compression, chunk));
    std::string counts;
    for (const auto& [topic, entries] : index) {
      const auto number = static_cast<std::uint32_t>(topic), count = static_cast<std::uint32_t>(entries.size() / 12);
      counts += raw(number) + raw(count);
      if (layout.index)
        body += record1(4, {{"ver", raw<std::uint32_t>(1)}, {"conn", raw(number)}, {"count", raw(count)}}, entries);
    }
    infos += record1(6,
                     {{"ver", raw<std::uint32_t>(1)},
                      {"chunk_pos", raw(at)},
                      {"start_time", time1(messages[from].time_ns)},
                      {"end_time", time1(messages[to - 1].time_ns)},
                      {"count", raw(static_cast<std::uint32_t>(index.size()))}},
                     counts);
  }
  const std::uint64_t index_at = layout.index ? start.size() + kHeaderBytes + body.size() : 0;
  const Fields header = {{"index_pos", raw(index_at)},
                         {"conn_count", raw(static_cast<std::uint32_t>(topics.size()))},
                         {"chunk_count", raw(chunks)}};
  const std::size_t used = record1(3, header, "").size();
  std::string out = start + record1(3, header, std::string(kHeaderBytes - used, ' ')) + body;
  if (!layout.index) return out;
  for (std::size_t topic = 0; topic < topics.size(); ++topic)
    out += connection1(static_cast<std::uint32_t>(topic), *topics[topic]);
  return out + infos;
}

std::string mcap_bytes(const std::vector<TestMessage>& messages, Wire wire, const BagLayout& layout) {
  const std::string magic("\x89MCAP0\r\n", 8), serialisation = wire == Wire::kProtobuf ? "protobuf"
                                                               : wire == Wire::kRos1   ? "ros1"
                                                                                       : "cdr";
  const auto topics = first_of_topics(messages);
  std::string channels;
  for (std::size_t t = 0; t < topics.size(); ++t) {
    const auto number = static_cast<std::uint16_t>(t + 1);
    const std::string type =
        wire == Wire::kRos1 || wire == Wire::kProtobuf ? topics[t]->type : ros2_type(topics[t]->type);
    channels += record2(3, raw(number) + counted(type) + counted("") + counted(""));
    channels +=
        record2(4, raw(number) + raw(number) + counted(topics[t]->topic) + counted(serialisation) + counted(""));
  }
  const auto message_record = [&](const TestMessage& message) {
    const auto number = static_cast<std::uint16_t>(topic_number(topics, message) + 1);
    const auto time = static_cast<std::uint64_t>(message.time_ns);
    return record2(5, raw(number) + raw<std::uint32_t>(0) + raw(time) + raw(time) + message.bytes);
  };
  std::string out = magic + record2(1, counted(wire == Wire::kRos1 ? "ros1" : "") + counted("test")), chunk_index;
  if (layout.messages_per_chunk == 0) {
    out += channels;
    for (const TestMessage& message : messages) out += message_record(message);
  }
  for (std::size_t from = 0; layout.messages_per_chunk > 0 && from < messages.size();
       from += layout.messages_per_chunk) {
    const std::size_t to = std::min(messages.size(), from + layout.messages_per_chunk);
    std::string chunk = channels;
    std::map<std::uint16_t, std::string> index;
    for (std::size_t k = from; k < to; ++k) {
      const auto number = static_cast<std::uint16_t>(topic_number(topics, messages[k]) + 1);
      index[number] +=
          raw(static_cast<std::uint64_t>(messages[k].time_ns)) + raw(static_cast<std::uint64_t>(chunk.size()));
      chunk += message_record(messages[k]);
    }
    const std::string packed = compress(layout.compression, chunk);
    const std::uint64_t at = out.size();
    const std::string times = raw(static_cast<std::uint64_t>(messages[from].time_ns)) +
                              raw(static_cast<std::uint64_t>(messages[to - 1].time_ns));
    out += record2(6, times + raw(static_cast<std::uint64_t>(chunk.size())) +
                          raw(libdeflate_crc32(0, chunk.data(), chunk.size())) + counted(layout.compression) +
                          raw(static_cast<std::uint64_t>(packed.size())) + packed);
    chunk_index +=
        record2(8, times + raw(at) + raw(static_cast<std::uint64_t>(out.size() - at)) + counted("") +
                       raw<std::uint64_t>(0) + counted(layout.compression) +
                       raw(static_cast<std::uint64_t>(packed.size())) + raw(static_cast<std::uint64_t>(chunk.size())));
    for (const auto& [number, entries] : index) {
      if (layout.index) out += record2(7, raw(number) + counted(entries));
    }
  }
  if (!layout.index) return out;
  out += record2(15, raw<std::uint32_t>(0));
  const std::uint64_t summary = out.size();
  out += channels + chunk_index;
  return out + record2(2, raw(summary) + raw<std::uint64_t>(0) + raw<std::uint32_t>(0)) + magic;
}

void write_sqlite_bag(const std::filesystem::path& file, const std::vector<TestMessage>& messages, bool zstd) {
  sqlite3* database = nullptr;
  sqlite3_open(file.c_str(), &database);
  sqlite3_exec(
      database,
      "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, serialization_format "
      "TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL);"
      "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL, data "
      "BLOB NOT NULL); BEGIN;",
      nullptr, nullptr, nullptr);
  const auto topics = first_of_topics(messages);
  const auto run = [&](const char* sql, const auto& bind) {
    sqlite3_stmt* statement = nullptr;
    sqlite3_prepare_v2(database, sql, -1, &statement, nullptr);
    bind(statement);
    sqlite3_step(statement);
    sqlite3_finalize(statement);
  };
  for (std::size_t t = 0; t < topics.size(); ++t) {
    run("INSERT INTO topics VALUES(?, ?, ?, 'cdr', '')", [&](sqlite3_stmt* s) {
      sqlite3_bind_int64(s, 1, static_cast<sqlite3_int64>(t + 1));
      sqlite3_bind_text(s, 2, topics[t]->topic.c_str(), -1, SQLITE_TRANSIENT);
      sqlite3_bind_text(s, 3, ros2_type(topics[t]->type).c_str(), -1, SQLITE_TRANSIENT);
    });
  }
  for (const TestMessage& message : messages) {
    const std::string bytes = zstd ? compress("zstd", message.bytes) : message.bytes;
    run("INSERT INTO messages(topic_id, timestamp, data) VALUES(?, ?, ?)", [&](sqlite3_stmt* s) {
      sqlite3_bind_int64(s, 1, static_cast<sqlite3_int64>(topic_number(topics, message) + 1));
      sqlite3_bind_int64(s, 2, message.time_ns);
      sqlite3_bind_blob(s, 3, bytes.data(), static_cast<int>(bytes.size()), SQLITE_TRANSIENT);
    });
  }
  sqlite3_exec(database, "COMMIT", nullptr, nullptr, nullptr);
  sqlite3_close(database);
}

}  // namespace bslam::support
