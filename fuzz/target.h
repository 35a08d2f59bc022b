// The interface of fuzz targets. Every target provides a function and seeds for one of two drivers: libFuzzer, if the
// compiler has it (it uses the function, and a corpus of seeds on disk), or the driver of driver.cc.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace bslam::fuzz {

// Small valid files, from which mutation starts.
std::vector<std::string> seeds();

inline std::string_view as_text(const std::uint8_t* data, std::size_t size) {
  return {reinterpret_cast<const char*>(data), size};
}

// A folder for readers that require a path. It is created by the first call, in memory if possible, and removed at the
// end of the process.
const std::filesystem::path& scratch_folder();

// Writes `bytes` to a file of that folder.
std::filesystem::path scratch_file(std::string_view name, std::string_view bytes);

// Aborts with a message if `holds` is false, which indicates an error in the program, not in the input.
void require(bool holds, const char* what);

}  // namespace bslam::fuzz
