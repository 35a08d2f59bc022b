#include "cli/finite_numbers.h"

#include <cmath>
#include <string>

#include "cli/command_line_error.h"

namespace bslam::cli {
namespace {

// Returns the message of the parser; empty for a finite number, and for what is no number, about which the parser has a
// message of its own.
std::string check_finite(const std::string& text) {
  double value = 0;
  const bool is_number = CLI::detail::lexical_cast(text, value);
  return is_number && !std::isfinite(value) ? "Value " + text + std::string(kNotFinite) : "";
}

}  // namespace

void refuse_infinite_numbers(CLI::App& app) {
  for (CLI::Option* option : app.get_options()) {
    if (option->get_type_name().find("FLOAT") != std::string::npos) option->check(check_finite);
  }
  for (CLI::App* verb : app.get_subcommands([](const CLI::App*) { return true; })) refuse_infinite_numbers(*verb);
}

}  // namespace bslam::cli
