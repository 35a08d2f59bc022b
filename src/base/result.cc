#include "base/result.h"

#include <cstdio>
#include <cstdlib>

namespace bslam {

void bad_result_access(const char* message) {
  std::fprintf(stderr, "bslam: assertion failed: %s\n", message);
  std::abort();
}

std::string Error::message() const {
  std::string text;
  for (const std::string* part : {&file, &key}) {
    if (!part->empty() && sentence.find(*part) == std::string::npos) text += *part + ": ";
  }
  if (!sentence.empty()) {
    text += sentence;
  } else {
    if (!found.empty()) text += "found " + found;
    if (!expected.empty()) text += std::string(found.empty() ? "" : ", ") + "expected " + expected;
  }
  if (text.ends_with(": ")) text.resize(text.size() - 2);  // neither found nor expected is given
  for (char& c : text) {
    if (static_cast<unsigned char>(c) < 0x20) c = ' ';
  }
  return text;
}

}  // namespace bslam
