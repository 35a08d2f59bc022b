#include "cli/command_line_error.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/nearest_name.h"
#include "base/number_text.h"

namespace bslam::cli {
namespace {

// Returns the innermost command that was recognised: for `bslam map info`, this is `info`.
const CLI::App& chosen(const CLI::App& app) {
  const auto verbs = app.get_subcommands();
  return verbs.empty() ? app : chosen(*verbs.back());
}

std::vector<std::string> options_of(const CLI::App& verb) {
  std::vector<std::string> names;
  for (const CLI::Option* option : verb.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  }
  return names;
}

std::vector<std::string> verbs_of(const CLI::App& verb) {
  std::vector<std::string> names;
  for (const CLI::App* v : verb.get_subcommands([](const CLI::App*) { return true; })) names.push_back(v->get_name());
  return names;
}

// Returns the full name of a command, such as "bslam map info".
std::string path_of(const CLI::App& verb) {
  return verb.get_parent() == nullptr ? "bslam" : path_of(*verb.get_parent()) + " " + verb.get_name();
}

bool is_option(const std::string& word) { return word.size() > 1 && word.front() == '-' && word != "--"; }

// Whether the word is a port that was meant as the value of --view.
bool is_port_of_view(const CLI::App& verb, const std::string& word) {
  const CLI::Option* view = verb.get_option_no_throw("--view");
  return view != nullptr && view->count() > 0 && !word.empty() &&
         word.find_first_not_of("0123456789") == std::string::npos;
}

Error sentence_error(std::string sentence) {
  Error error;
  error.sentence = std::move(sentence);
  return error;
}

// The parts of a text before and after a word.
struct Parts {
  std::string before, behind;
};

std::optional<Parts> parted(const std::string& text, std::string_view word) {
  const std::size_t at = text.find(word);
  if (at == std::string::npos) return std::nullopt;
  return Parts{text.substr(0, at), text.substr(at + word.size())};
}

Error option_error(const std::string& option, std::string found, std::string expected) {
  return {"command line", option, std::move(found), std::move(expected)};
}

// The numbers of a range, as the parser writes it: "0 to 10", or in later versions "[0 - 10]".
std::string range_text(std::string range, const std::string& kind) {
  std::erase_if(range, [](char c) { return c == '[' || c == ']'; });
  auto bounds = parted(range, " to ");
  if (!bounds) bounds = parted(range, " - ");
  const auto least = bounds ? parse_double(bounds->before) : std::nullopt;
  const auto most = bounds ? parse_double(bounds->behind) : std::nullopt;
  constexpr double kNoBound = 1e300;
  if (!least || !most) return kind + " in the range " + range;
  if (*most > kNoBound)
    return *least > 0 && *least < 1 / kNoBound ? kind + " above 0" : fmt::format("{} of {:.10g} or more", kind, *least);
  return fmt::format("{} from {:.10g} to {:.10g}", kind, *least, *most);
}

std::string kind_of_value(const CLI::App& verb, const std::string& option) {
  const CLI::Option* const known = verb.get_option_no_throw(option);
  const std::string type = known == nullptr ? "" : known->get_type_name();
  if (type.find("FLOAT") != std::string::npos) return "a number";
  return type.find("INT") != std::string::npos ? "a whole number" : "a value";
}

// Converts the parser's messages about the value of an option to `found` and `expected`; nullopt for other messages.
std::optional<Error> value_error(const CLI::App& verb, const std::string& text) {
  if (const auto parts = parted(text, "Could not convert: ")) {
    const auto value = parted(parts->behind, " = ");
    if (value) return option_error(value->before, value->behind, kind_of_value(verb, value->before));
  }
  if (const auto pair = parted(text, " excludes "))
    return option_error(pair->before, pair->behind + " as well",
                        fmt::format("one of {} and {}", pair->before, pair->behind));
  if (const auto pair = parted(text, " requires "))
    return option_error(pair->before, "no " + pair->behind, pair->behind + " as well");
  const auto parts = parted(text, ": ");
  if (!parts) return std::nullopt;
  if (parts->behind == kEmptyValue)
    return option_error(parts->before, "an empty value", kind_of_value(verb, parts->before));
  if (text.find(" required ") != std::string::npos && text.ends_with(" missing"))
    return option_error(parts->before, "no value after it", kind_of_value(verb, parts->before));
  if (const auto set = parted(parts->behind, " not in {"); set && set->behind.ends_with('}')) {
    std::string names = set->behind.substr(0, set->behind.size() - 1);
    for (std::size_t at = 0; (at = names.find(',', at)) != std::string::npos; at += 2) names.replace(at, 1, ", ");
    return option_error(parts->before, set->before, "one of: " + names);
  }
  if (const auto range = parted(parts->behind, " not in range "); range && range->before.starts_with("Value "))
    return option_error(parts->before, range->before.substr(std::string_view("Value ").size()),
                        range_text(range->behind, kind_of_value(verb, parts->before)));
  if (const auto value = parted(parts->behind, kNotFinite); value && value->before.starts_with("Value "))
    return option_error(parts->before, value->before.substr(std::string_view("Value ").size()), "a finite number");
  return std::nullopt;
}

}  // namespace

Error command_line_error(const CLI::App& app, const CLI::ParseError& error) {
  const CLI::App& verb = chosen(app);
  const std::string see_help = "see " + path_of(verb) + " --help";
  const auto hint = [&](const std::string& nearest) {
    return nearest.empty() ? "; " + see_help : "; did you mean '" + nearest + "'?";
  };
  const std::vector<std::string> unknown = app.remaining(true);
  const auto word = std::ranges::find_if_not(unknown, is_option);
  const std::vector<std::string> verbs = verbs_of(verb);
  if (word != unknown.end() && !verbs.empty()) {
    return sentence_error("unknown command '" + *word + "'" + hint(nearest_name(*word, verbs)));
  }
  if (word != unknown.end() && is_port_of_view(verb, *word))
    return sentence_error("unexpected '" + *word + "'; did you mean '--view=" + *word + "'?");
  const auto option = std::ranges::find_if(unknown, is_option);
  if (option != unknown.end()) {
    const std::string name = option->substr(0, option->find('='));
    const std::string nearest = nearest_name(name, options_of(verb));
    if (nearest == name) return sentence_error("option '" + name + "' must follow the command");
    return sentence_error("unknown option '" + name + "'" + hint(nearest));
  }
  if (auto of_value = value_error(verb, error.what())) return *std::move(of_value);
  return sentence_error(std::string(error.what()) + " (" + see_help + ")");
}

}  // namespace bslam::cli
