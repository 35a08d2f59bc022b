// bslam map transfer: the trajectory of a run in the world frame of a merged map.
#include <fmt/format.h>

#include <memory>
#include <string>

#include "base/output_file.h"
#include "cli/verbs.h"
#include "evaluation/trajectory_file.h"
#include "session/transfer_trajectory.h"
#include "storage/map_file.h"

namespace bslam::cli {
namespace {

struct TransferArguments {
  std::string trajectory, from, to, out;
  bool overwrite = false;
};

int map_transfer(const TransferArguments& arguments) {
  for (const Status& s : {check_not_input(arguments.out, "--out", {arguments.trajectory, arguments.from, arguments.to}),
                          check_new_file(arguments.out, arguments.overwrite)})
    if (!s) return report_error(s.error());
  const auto trajectory = evaluation::read_trajectory(arguments.trajectory);
  if (!trajectory) return report_error(trajectory.error());
  const auto own = storage::read_map(arguments.from);
  if (!own) return report_error(own.error());
  const auto merged = storage::read_map(arguments.to);
  if (!merged) return report_error(merged.error());
  const auto input = evaluation::read_comments(arguments.trajectory);
  const auto moved = session::transfer_trajectory(*trajectory, *own, *merged, input);
  if (!moved) return report_error(moved.error());
  evaluation::TrajectoryComments output = input;
  output.parent = evaluation::world_of_submap(moved->submap);
  output.frame = input.frame_of_poses().empty() ? "cam0" : input.frame_of_poses();
  const Status s = evaluation::write_trajectory(arguments.out, moved->poses, evaluation::TrajectoryFormat::kTum,
                                                evaluation::text_of(output));
  if (!s) return report_error(s.error());
  fmt::print("{} poses, transformed by {} keyframes that both maps contain, are in the frame {}\n{}\n",
             moved->poses.size(), moved->keyframes, output.parent, arguments.out);
  return kExitOk;
}

}  // namespace

void add_map_transfer(CLI::App& map, int& exit_status) {
  const auto arguments = std::make_shared<TransferArguments>();
  CLI::App* transfer =
      map.add_subcommand("transfer", "write the trajectory of a run in the world frame of a merged map");
  transfer->add_option("TRAJECTORY", arguments->trajectory, "trajectory of the run, such as trajectory.tum")
      ->required();
  transfer->add_option("--from", arguments->from, "the map that the run has saved")->required();
  transfer->add_option("--to", arguments->to, "a map into which it was merged")->required();
  transfer->add_option("--out", arguments->out, "file for the trajectory (TUM)")->required();
  transfer->add_flag("--overwrite", arguments->overwrite, "replace an existing file");
  transfer->callback([arguments, &exit_status] { exit_status = map_transfer(*arguments); });
}

}  // namespace bslam::cli
