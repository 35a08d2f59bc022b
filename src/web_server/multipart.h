// The body of a request of the type multipart/form-data (RFC 7578): the fields of a form, among them files.
#pragma once

#include <cstddef>
#include <string_view>
#include <vector>

#include "base/result.h"

namespace bslam::web_server {

struct FormPart {
  std::string_view name;     // name of the field, as sent
  std::string_view content;  // bytes
};

struct FormLimits {
  std::size_t parts = 64;
  std::size_t header_bytes = 2048;  // maximum size of the headers of one part
};

// Splits the body into its parts, which refer to `body`. Names of files and types of parts are ignored. Errors: another
// type or no boundary; a body that is not divided into parts by the boundary, or does not end with the closing
// boundary, such as a truncated one; a part without a name; more or longer than the limits. The time is proportional to
// the length of the body.
Result<std::vector<FormPart>> parse_form(std::string_view content_type, std::string_view body,
                                         const FormLimits& limits = {});

}  // namespace bslam::web_server
