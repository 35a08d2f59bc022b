// What a fuzz target is made of. Every target gives its function and seeds to one of two drivers: libFuzzer, where the
// compiler has it (it takes the function; the seeds come as a corpus on disk), or the one of driver.cc.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace bslam::fuzz {

// Small files that are right: what mutation starts from.
std::vector<std::string> seeds();

inline std::string_view as_text(const std::uint8_t* data, std::size_t size) {
  return {reinterpret_cast<const char*>(data), size};
}

// A folder of this process, made at the first call and removed at its end, in memory where the system has such a place:
// for readers that take a path.
const std::filesystem::path& scratch_folder();

// Writes `bytes` to a file of that folder.
std::filesystem::path scratch_file(std::string_view name, std::string_view bytes);

// Stops with a message where `holds` is false: what is wrong then is the program, not the input.
void require(bool holds, const char* what);

}  // namespace bslam::fuzz
