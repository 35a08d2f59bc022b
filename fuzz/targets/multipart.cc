// Forms of HTTP requests.
#include "web_server/multipart.h"

#include "target.h"

namespace bslam::fuzz {

// The first line is the type of the request, the rest its body.
std::vector<std::string> seeds() {
  const std::string part = "--b\r\nContent-Disposition: form-data; name=\"cam0\"; filename=\"a.png\"\r\n\r\npixels\r\n";
  return {"multipart/form-data; boundary=b\n" + part + "--b--\r\n",
          "multipart/form-data; boundary=\"b\"\n" + part + part + "--b--",
          "multipart/form-data; charset=utf-8; boundary=b\n--b--"};
}

}  // namespace bslam::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace bslam;
  const std::string_view text = fuzz::as_text(data, size);
  const std::size_t line = text.find('\n');
  if (line == std::string_view::npos) return 0;
  const std::string_view body = text.substr(line + 1);
  const web_server::FormLimits limits{.parts = 8};
  const auto parts = web_server::parse_form(text.substr(0, line), body, limits);
  if (!parts) return 0;
  fuzz::require(parts->size() <= limits.parts, "the number of parts must be limited");
  const char* last = body.data();
  for (const web_server::FormPart& part : *parts) {
    fuzz::require(!part.name.empty(), "every part must have a name");
    fuzz::require(part.name.data() >= last && part.content.data() >= part.name.data() + part.name.size(),
                  "parts must be in order");
    last = part.content.data() + part.content.size();
    fuzz::require(last <= body.data() + body.size(), "parts must be in the body");
  }
  return 0;
}
