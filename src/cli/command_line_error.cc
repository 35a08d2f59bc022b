#include "cli/command_line_error.h"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "base/nearest_name.h"

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
  return sentence_error(std::string(error.what()) + " (" + see_help + ")");
}

}  // namespace bslam::cli
