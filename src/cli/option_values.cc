#include "cli/option_values.h"

#include <algorithm>
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

// Throws the error of the parser for an empty value. An option whose value may be left out has an empty one then.
void check_not_empty(const CLI::App& app) {
  for (const CLI::Option* option : app.get_options()) {
    const bool may_lack_value = option->get_items_expected_min() == 0;
    if (!may_lack_value && std::ranges::any_of(option->results(), &std::string::empty))
      throw CLI::ValidationError(option->get_name(), std::string(kEmptyValue));
  }
}

}  // namespace

void check_option_values(CLI::App& app) {
  for (CLI::Option* option : app.get_options()) {
    if (option->get_type_name().find("FLOAT") != std::string::npos) option->check(check_finite);
  }
  app.parse_complete_callback([&app] { check_not_empty(app); });
  for (CLI::App* verb : app.get_subcommands([](const CLI::App*) { return true; })) check_option_values(*verb);
}

}  // namespace bslam::cli
