// bslam map merge: joins maps of separate runs.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "base/interrupted.h"
#include "base/output_file.h"
#include "cli/config_arguments.h"
#include "cli/interruption.h"
#include "cli/print_message.h"
#include "cli/verbs.h"
#include "cli/version.h"
#include "session/merge_maps.h"
#include "storage/map_file.h"
#include "storage/vocabulary_file.h"

namespace bslam::cli {
namespace {

struct MergeArguments {
  std::vector<std::string> files;
  std::string out, vocabulary;
  ConfigArguments config;
  bool json = false, overwrite = false, no_final_ba = false, dry_run = false;
};

// Returns text such as "1 submap" or "2 submaps".
std::string counted(std::size_t count, std::string_view name) {
  return fmt::format("{} {}{}", count, name, count == 1 ? "" : "s");
}

void print_json(const session::MergeResult& merged) {
  nlohmann::ordered_json inputs = nlohmann::ordered_json::array();
  for (const session::MergedInput& input : merged.inputs) {
    inputs.push_back({{"file", input.file},
                      {"keyframes", input.keyframes},
                      {"submap", input.submap},
                      {"joined", input.reason.empty()},
                      {"reason", input.reason}});
  }
  nlohmann::ordered_json scales = nlohmann::ordered_json::array();
  for (const session::ScaleComparison& c : merged.scales) {
    scales.push_back({{"files", {merged.inputs[c.first].file, merged.inputs[c.second].file}},
                      {"ratio", c.ratio},
                      {"deviation", c.deviation},
                      {"keyframes", c.views},
                      {"disagree", c.disagrees()}});
  }
  const nlohmann::ordered_json all = {{"schema", 1},
                                      {"keyframes", merged.map.num_keyframes()},
                                      {"landmarks", merged.map.num_landmarks()},
                                      {"submaps", merged.map.roots().size()},
                                      {"merged", merged.joined},
                                      {"loops", merged.loops},
                                      {"inputs", std::move(inputs)},
                                      {"scales", std::move(scales)}};
  std::printf("%s\n", all.dump(1, ' ', false, nlohmann::json::error_handler_t::replace).c_str());
}

void print_text(const session::MergeResult& merged) {
  for (const session::MergedInput& input : merged.inputs) {
    if (!input.reason.empty()) fmt::print("not joined: {}: {} (submap {})\n", input.file, input.reason, input.submap);
  }
  for (const session::ScaleComparison& c : merged.scales) {
    fmt::print("{}: lengths in {} are {:.4f} (std {:.4f}) times those in {}\n",
               c.disagrees() ? "scales disagree" : "scales agree", merged.inputs[c.second].file, c.ratio,
               c.deviation * c.ratio, merged.inputs[c.first].file);
  }
  fmt::print("{} keyframes, {} landmarks; merged {}, {}, {} remaining\n", merged.map.num_keyframes(),
             merged.map.num_landmarks(), counted(static_cast<std::size_t>(merged.joined), "submap"),
             counted(static_cast<std::size_t>(merged.loops), "further loop closure"),
             counted(merged.map.roots().size(), "submap"));
}

Result<session::MergeResult> merge(const MergeArguments& arguments, const place::VocabularyPtr& vocabulary,
                                   const std::stop_token& interrupted) {
  auto config = resolve_config(arguments.config);
  if (!config) return config.error();
  std::vector<storage::SavedMap> maps;
  for (const std::string& file : arguments.files) {
    if (Status s = not_interrupted(interrupted); !s) return s.error();
    auto saved = storage::read_map(file);
    if (!saved) return saved.error();
    maps.push_back(*std::move(saved));
  }
  auto merged = session::merge_maps(std::move(maps), vocabulary, *config, interrupted);
  if (merged && !arguments.dry_run && !arguments.no_final_ba) session::adjust_merged(merged->map, *config, interrupted);
  if (Status s = not_interrupted(interrupted); !s) return s.error();
  return merged;
}

Status write(const session::MergeResult& merged, const std::string& file) {
  std::vector<std::string> recordings;
  for (const session::MergedInput& input : merged.inputs) recordings.push_back(input.data);
  const std::vector<std::string> warnings = session::warnings_of(merged, &session::MergedInput::data);
  const storage::MapFileInfo info{merged.vocabulary, version_number(),
                                  fmt::format("{}", fmt::join(recordings, session::kBetweenRecordings)),
                                  fmt::format("{}", fmt::join(warnings, "; "))};
  return storage::write_map(merged.map, info, file);
}

// Neither a map nor another file of the input is replaced.
Status check_out(const MergeArguments& arguments) {
  if (arguments.dry_run) return {};
  std::vector<std::filesystem::path> inputs(arguments.files.begin(), arguments.files.end());
  inputs.insert(inputs.end(), {arguments.vocabulary, arguments.config.file});
  if (Status other = check_not_input(arguments.out, "--out", inputs); !other) return other;
  return check_output_file(arguments.out, "--out", arguments.overwrite, storage::kMapFileBegin);
}

int map_merge(const MergeArguments& arguments) {
  if (arguments.out.empty() && !arguments.dry_run)
    return report_error({"command line", "--out", "no file", "a file for the merged map, or --dry-run"});
  if (const Status s = check_out(arguments); !s) return report_error(s.error());
  const auto vocabulary = storage::vocabulary_or_shipped(arguments.vocabulary);
  if (!vocabulary) return report_error(vocabulary.error());
  const Interruption interruption;
  const auto merged = merge(arguments, *vocabulary, interruption.token());
  if (!merged) {
    const int status = report_error(merged.error());
    return interruption.token().stop_requested() ? kExitInterrupted : status;
  }
  if (!arguments.dry_run) {
    if (const Status s = write(*merged, arguments.out); !s) return report_error(s.error());
  }
  for (const std::string& warning : session::warnings_of(*merged, &session::MergedInput::file))
    print_message("warning: {}\n", warning);
  arguments.json ? print_json(*merged) : print_text(*merged);
  if (!arguments.dry_run && !arguments.json) fmt::print("{}\n", arguments.out);
  return kExitOk;
}

}  // namespace

void add_map_merge(CLI::App& map, int& exit_status) {
  const auto arguments = std::make_shared<MergeArguments>();
  CLI::App* merge = map.add_subcommand("merge", "merge maps of separate runs that contain common places");
  merge
      ->add_option("MAPS", arguments->files,
                   "saved maps, of any rigs; their order does not matter, and one is only adjusted")
      ->required()
      ->expected(1, CLI::detail::expected_max_vector_size);
  merge->add_option("--out", arguments->out, "file for the merged map");
  merge->add_option("--vocabulary", arguments->vocabulary,
                    "vocabulary of the maps; default: the vocabulary shipped with this program");
  merge->add_flag("--no-final-ba", arguments->no_final_ba, "skip the global bundle adjustment at the end");
  merge->add_flag("--dry-run", arguments->dry_run, "only print which maps would be joined");
  merge->add_flag("--json", arguments->json, "print JSON");
  merge->add_flag("--overwrite", arguments->overwrite, "replace an existing file");
  add_config_options(*merge, arguments->config);
  merge->callback([arguments, &exit_status] { exit_status = map_merge(*arguments); });
}

}  // namespace bslam::cli
