#include "base/result.h"

namespace bslam {

std::string Error::message() const {
  std::string text;
  for (const std::string* part : {&file, &key}) {
    if (!part->empty()) text += *part + ": ";
  }
  if (!found.empty()) text += "found " + found;
  if (!expected.empty()) text += std::string(found.empty() ? "" : ", ") + "expected " + expected;
  if (text.ends_with(": ")) text.resize(text.size() - 2);  // the message has only a location
  for (char& c : text) {
    if (static_cast<unsigned char>(c) < 0x20) c = ' ';
  }
  return text;
}

}  // namespace bslam
