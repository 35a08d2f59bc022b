#include "cli/trajectory_camera.h"

#include <fmt/format.h>

#include <string>

#include "camera/camera_name.h"
#include "cli/print_message.h"

namespace bslam::cli {

Result<std::size_t> camera_of_trajectory(const std::filesystem::path& trajectory,
                                         const evaluation::TrajectoryComments& comments, const camera::Rig& rig,
                                         const std::filesystem::path& rig_file, std::optional<int> option) {
  const std::string frame = option ? comments.frame : comments.frame_of_poses();
  const auto named = camera::camera_of_frame(frame, rig);
  if (!option) {
    if (named) return *named;
    return Error{trajectory.string(), "frame", frame,
                 "a camera of " + rig_file.string() + "; --camera N says which one it is"};
  }
  if (static_cast<std::size_t>(*option) >= rig.size())
    return Error{rig_file.string(), "--camera", std::to_string(*option),
                 fmt::format("a camera number below {}", rig.size())};
  const auto chosen = static_cast<std::size_t>(*option);
  if (!frame.empty() && frame != "cam0" && named != chosen) {
    print_message("note: {} contains poses of {}, but --camera {} is {} of {}\n", trajectory.string(), frame, chosen,
                  rig.camera(chosen).name, rig_file.string());
  }
  return chosen;
}

}  // namespace bslam::cli
