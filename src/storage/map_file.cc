#include "storage/map_file.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <utility>

#include "base/atomic_file.h"
#include "base/cores.h"
#include "base/mapped_file.h"
#include "base/number_text.h"
#include "map/rigs_of_map.h"
#include "storage/map_checksum.h"
#include "storage/map_sections.h"

namespace bslam::storage {
namespace {

constexpr std::uint32_t kOrderMark = 0x01020304, kVersion = 6, kOldestVersion = 2;
constexpr std::array<std::string_view, 4> kTags = {"RIG ", "INFO", "KEYF", "LAND"};
constexpr std::array<const char*, 4> kNames = {"rig", "info", "keyframes", "landmarks"};
constexpr std::size_t kTableEntryBytes = 4 + 4 + 8;
constexpr std::size_t kHeaderBytes = 8 + 3 * 4 + 8 + kTags.size() * kTableEntryBytes + 4;
constexpr std::size_t kMaxMapBytes = std::size_t{1} << 36;

constexpr std::size_t kMappedBytes = std::size_t{1} << 26;  // smaller files are read as a whole
constexpr std::size_t kParallelBytes = std::size_t{1} << 20;
constexpr int kMaxThreads = 8;

// Threads to write or read so many bytes.
int threads_for(std::size_t bytes) {
  if (bytes < kParallelBytes) return 1;
  return std::min(processor_cores(), kMaxThreads);
}

struct Sections {
  std::uint32_t version = kVersion;
  std::array<std::string_view, kTags.size()> bytes = {};
  std::array<std::uint32_t, kTags.size()> checksums = {};
};

std::string header_of(std::span<const std::string, kTags.size()> sections, ThreadPool& pool) {
  std::size_t total = kHeaderBytes;
  for (const std::string& s : sections) total += s.size();
  ByteWriter out;
  out.numbers(kMapFileBegin.data(), kMapFileBegin.size());
  out.number(kOrderMark);
  out.number(kVersion);
  out.number(static_cast<std::uint32_t>(kTags.size()));
  out.number(std::uint64_t{total});
  for (std::size_t i = 0; i < kTags.size(); ++i) {
    out.numbers(kTags[i].data(), kTags[i].size());
    out.number(section_checksum(sections[i], pool));
    out.number(std::uint64_t{sections[i].size()});
  }
  std::string header = std::move(out).take();
  ByteWriter seal;
  seal.number(crc32_of(header));
  return header + std::move(seal).take();
}

Error damaged(std::string_view section, std::string found, std::string expected) {
  return {"", std::string(section), std::move(found), std::move(expected)};
}

// Returns the sections of a complete file after verifying their checksums. Error.file is left empty.
Result<Sections> take_apart(std::string_view bytes, ThreadPool& pool) {
  if (!bytes.starts_with(kMapFileBegin))
    return damaged("", "a file of another format", fmt::format("a saved map, which begins with {}", kMapFileBegin));
  if (bytes.size() < kHeaderBytes) return damaged("header", fmt::format("{} bytes", bytes.size()), "a complete header");
  SectionReader in(bytes.substr(kMapFileBegin.size(), kHeaderBytes - kMapFileBegin.size()), "header");
  if (in.number<std::uint32_t>() != kOrderMark) return damaged("header", "another byte order", "little endian");
  const auto version = in.number<std::uint32_t>();
  if (version < kOldestVersion || version > kVersion) {
    return damaged("format version", std::to_string(version), fmt::format("{} to {}", kOldestVersion, kVersion));
  }
  const auto count = in.number<std::uint32_t>();
  const auto total = in.number<std::uint64_t>();
  struct Entry {
    std::array<char, 4> tag;
    std::uint32_t checksum;
    std::uint64_t size;
  };
  std::array<Entry, kTags.size()> table;
  for (Entry& e : table) {
    in.numbers(e.tag.data(), e.tag.size());
    e.checksum = in.number<std::uint32_t>();
    e.size = in.number<std::uint64_t>();
  }
  if (in.number<std::uint32_t>() != crc32_of(bytes.substr(0, kHeaderBytes - 4)) || count != kTags.size()) {
    return damaged("header", "a wrong checksum", "an undamaged file");
  }
  if (total != bytes.size()) return damaged("size", fmt::format("{} bytes", bytes.size()), std::to_string(total));
  Sections sections{.version = version};
  std::string_view rest = bytes.substr(kHeaderBytes);
  for (std::size_t i = 0; i < kTags.size(); ++i) {
    const Entry& e = table[i];
    if (std::string_view(e.tag.data(), e.tag.size()) != kTags[i])
      return damaged("header", "unknown sections", "the sections of this format version");
    if (e.size > rest.size())
      return damaged(kNames[i], "a section beyond the end of the file", "a section within the file");
    sections.bytes[i] = rest.substr(0, e.size);
    sections.checksums[i] = e.checksum;
    rest.remove_prefix(e.size);
    const std::uint32_t found = version >= 5 ? section_checksum(sections.bytes[i], pool) : crc32_of(sections.bytes[i]);
    if (found != e.checksum) return damaged(kNames[i], "a wrong checksum", "an undamaged file");
  }
  if (!rest.empty()) return damaged("size", "bytes after the last section", "the end of the file");
  return sections;
}

// What the sections of keyframes and landmarks contradict each other in.
Error error_of(const map::PartsError& error) {
  std::string key = error.landmark ? fmt::format("landmarks, landmark {}", *error.landmark) : "keyframes";
  return damaged(key, error.found, error.expected);
}

Result<SavedMap> build(const Sections& sections, std::string file, const std::shared_ptr<const void>& owner,
                       ThreadPool& pool) {
  const auto reader = [&](std::size_t i) { return SectionReader(sections.bytes[i], kNames[i], owner); };
  SectionReader rig_in = reader(0), info_in = reader(1), keyframes_in = reader(2), landmarks_in = reader(3);
  auto rigs = take_rigs(rig_in, sections.version);
  if (!rigs) return rig_in.error();
  InfoSection info = take_info(info_in, sections.version);
  if (!info_in.ok()) return info_in.error();
  SavedMap saved{std::move(file), map::BundledMap(rigs->rig, info.pyramid), std::move(info.info)};
  saved.checksums = sections.checksums;
  saved.map.set_given_rig(rigs->given);
  saved.map.set_scale(info.scale);
  const bool with_words = saved.info.vocabulary != 0, old = sections.version < 5;
  const KeyframeSection k = old ? take_keyframes_4(keyframes_in, with_words, saved.map)
                                : take_keyframes(keyframes_in, with_words, saved.map, pool);
  if (!keyframes_in.ok()) return keyframes_in.error();
  saved.words_end = k.words_end;
  const LandmarkSection l = old ? take_landmarks_4(landmarks_in) : take_landmarks(landmarks_in);
  if (!landmarks_in.ok()) return landmarks_in.error();
  const map::MapParts parts{
      k.frames,    k.T_rig_world, k.parents, l.counts, [&l](std::size_t i) { return l.landmark(i); },
      l.observing, l.features,    l.aligned};
  if (const auto error = saved.map.fill(parts, pool)) return error_of(*error);
  for (std::size_t i = 0; old && i < saved.map.landmark_slots(); ++i) saved.map.refresh_landmark(LandmarkId(i));
  return saved;
}

}  // namespace

namespace {

// The header and the sections of a file.
std::array<std::string, 1 + kTags.size()> pieces_of(const map::BundledMap& map, const MapFileInfo& info) {
  const FileIds ids(map);
  std::array<ByteWriter, kTags.size()> writers;
  put_rigs(map, writers[0]);
  put_info(map, info, writers[1]);
  put_keyframes(map, ids, info.vocabulary != 0, writers[2]);
  put_landmarks(map, ids, writers[3]);
  std::array<std::string, 1 + kTags.size()> pieces;
  const std::span<std::string, kTags.size()> sections = std::span(pieces).last<kTags.size()>();
  for (std::size_t i = 0; i < kTags.size(); ++i) {
    writers[i].align();  // so that each section begins at a multiple of kAlignment
    sections[i] = std::move(writers[i]).take();
  }
  ThreadPool pool(threads_for(sections[2].size()));
  pieces[0] = header_of(sections, pool);
  return pieces;
}

}  // namespace

std::string map_to_bytes(const map::BundledMap& map, const MapFileInfo& info) {
  std::string bytes;
  for (const std::string& piece : pieces_of(map, info)) bytes += piece;
  return bytes;
}

namespace {

// `owner`: of the bytes.
Result<SavedMap> map_in(std::string_view bytes, const std::string& file, const std::shared_ptr<const void>& owner) {
  const auto named = [&](Error error) {
    error.file = file;
    return error;
  };
  ThreadPool pool(threads_for(bytes.size()));
  const auto sections = take_apart(bytes, pool);
  if (!sections) return named(sections.error());
  auto saved = build(*sections, file, owner, pool);
  if (!saved) return named(saved.error());
  return saved;
}

}  // namespace

Result<SavedMap> map_from_bytes(std::string_view bytes, std::string file) {
  const auto copy = std::make_shared<const std::string>(bytes);
  return map_in(*copy, file, copy);
}

std::string joined_warnings(const std::string& stored, const std::string& of_run) {
  if (stored.empty()) return of_run;
  return stored.find(of_run) != std::string::npos ? stored : stored + "; " + of_run;
}

Status write_map(const map::BundledMap& map, const MapFileInfo& info, const std::filesystem::path& file) {
  if (map.rig().size() > kMaxCameras) {
    return Error{file.string(), "rig", std::to_string(map.rig().size()) + " cameras",
                 "at most " + std::to_string(kMaxCameras)};
  }
  const auto pieces = pieces_of(map, info);
  const std::vector<std::string_view> views(pieces.begin(), pieces.end());
  return write_atomically(file, views);
}

Result<SavedMap> read_map(const std::filesystem::path& file) {
  std::error_code unknown;
  if (std::filesystem::is_regular_file(file, unknown) && std::filesystem::file_size(file, unknown) >= kMappedBytes) {
    const auto mapped = MappedFile::open(file, kMaxMapBytes);
    if (!mapped) return mapped.error();
    auto saved = map_in(mapped->bytes(), file.string(), mapped->owner());
    if (!saved) return saved;
    saved->map.set_file(std::make_shared<const MappedFile>(*mapped));
    saved->map.release_pages();
    return saved;
  }
  auto bytes = read_file(file, kMaxMapBytes);
  if (!bytes) return bytes.error();
  const auto owned = std::make_shared<const std::string>(*std::move(bytes));
  return map_in(*owned, file.string(), owned);
}

Result<SavedMap> open_map(const std::filesystem::path& file, const camera::Rig& rig,
                          const feature::PyramidShape& pyramid, const place::Vocabulary* vocabulary) {
  auto saved = read_map(file);
  if (!saved) return saved.error();
  if (const Status status = check_continued(*saved, rig, pyramid, vocabulary); !status) return status.error();
  return saved;
}

namespace {

// Whether any camera is apart from the origin of the rig frame, so that the unit of its calibration, the metre,
// matters.
bool has_distances(const camera::Rig& rig) {
  constexpr double kRounding_m = 1e-6;
  for (std::size_t c = 0; c < rig.size(); ++c) {
    if (rig.rig_from_cam(c).translation().norm() > kRounding_m) return true;
  }
  return false;
}

}  // namespace

Status check_continued(const SavedMap& saved, const camera::Rig& rig, const feature::PyramidShape& pyramid,
                       const place::Vocabulary* vocabulary) {
  if (const Status status = fits(saved, pyramid, vocabulary); !status) return status;
  const auto found = map::find_rig(saved.map, rig);
  const bool known = found.has_value();
  const map::Scale scale = saved.map.scale();  // a single camera has made the map if it is only up to scale
  if ((scale == map::Scale::kUpToScale || (scale == map::Scale::kUnobservable && !known)) && has_distances(rig)) {
    return Error{saved.file, "scale", "a map whose lengths are not in metres",
                 "a single camera, or a metric map, since the distances between the cameras of this rig are in metres"};
  }
  const bool appended = !known || !map::cameras_of(saved.map.rig(), *found, rig.size()).moves().empty();
  const std::size_t cameras = saved.map.rig().size() + (appended ? rig.size() : 0);
  if (cameras > kMaxCameras) {
    return Error{saved.file, "rig", fmt::format("{} cameras with those of this run", cameras),
                 fmt::format("at most {}; a map with fewer rigs", kMaxCameras)};
  }
  if (saved.map.num_keyframes() == 0) return Error{saved.file, "keyframes", "none", "a map with keyframes"};
  return {};
}

Status fits(const SavedMap& saved, const feature::PyramidShape& pyramid, const place::Vocabulary* vocabulary) {
  const feature::PyramidShape& saved_pyramid = saved.map.pyramid();
  if (saved_pyramid.levels != pyramid.levels || saved_pyramid.scale_factor != pyramid.scale_factor) {
    return Error{saved.file, "pyramid",
                 fmt::format("{} levels, factor {}", saved_pyramid.levels, saved_pyramid.scale_factor),
                 fmt::format("{} levels, factor {} (features.levels, features.scale_factor)", pyramid.levels,
                             pyramid.scale_factor)};
  }
  if (vocabulary == nullptr || saved.info.vocabulary == 0) return {};
  if (saved.info.vocabulary != vocabulary->id() || saved.words_end > vocabulary->size()) {
    return Error{saved.file, "vocabulary", fmt::format("{:016x}", saved.info.vocabulary),
                 fmt::format("{:016x} (vocabulary of this run)", vocabulary->id())};
  }
  return {};
}

}  // namespace bslam::storage
