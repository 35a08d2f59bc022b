#include "cli/command_line_error.h"

#include <algorithm>
#include <string>
#include <vector>

#include "base/nearest_name.h"

namespace bslam::cli {
namespace {

// The verb that was chosen last: `map info` within `map`.
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

std::string one_line(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

}  // namespace

Error command_line_error(const CLI::App& app, const CLI::ParseError& error) {
  const CLI::App& verb = chosen(app);
  const std::vector<std::string> unknown = app.remaining(true);
  const auto option = std::ranges::find_if(unknown, [](const std::string& word) { return word.size() > 1 && word.front() == '-'; });
  if (option != unknown.end()) {
    const std::string name = option->substr(0, option->find('='));
    return {"command line", one_line(name), "an unknown option", "perhaps " + nearest_name(name, options_of(verb))};
  }
  const std::vector<std::string> verbs = verbs_of(verb);
  if (!unknown.empty() && !verbs.empty()) {
    return {"command line", one_line(unknown.front()), "an unknown verb", "perhaps " + nearest_name(unknown.front(), verbs)};
  }
  const std::string whole = verb.get_parent() == nullptr ? "bslam" : "bslam " + verb.get_name();
  return {"command line", one_line(error.what()) + " (see " + whole + " --help)", "", ""};
}

}  // namespace bslam::cli
