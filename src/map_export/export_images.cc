// Exports of poses with images: COLMAP, nerfstudio, and the folder of points, keyframes, rig and COLMAP model.
#include <fmt/format.h>

#include "base/interrupted.h"
#include "evaluation/trajectory_file.h"
#include "image_decoding/colour_image.h"
#include "map_export/colmap_model.h"
#include "map_export/map_exporter.h"
#include "map_export/nerfstudio.h"
#include "map_export/point_cloud.h"
#include "rig_formats/bslam_rig.h"
#include "rig_formats/rig_file.h"
#include "storage/submaps.h"

namespace bslam::map_export {
namespace {

namespace fs = std::filesystem;

Status write_files(const ColmapModel& model, const AtomicFolder& folder) {
  const std::pair<const char*, const std::string*> files[] = {{"rigs.txt", &model.rigs},
                                                              {"frames.txt", &model.frames},
                                                              {"cameras.txt", &model.cameras},
                                                              {"images.txt", &model.images},
                                                              {"points3D.txt", &model.points}};
  for (const auto& [name, text] : files)
    if (Status s = folder.write(name, *text); !s) return s;
  return {};
}

std::string counts(std::size_t keyframes, std::size_t landmarks) {
  return fmt::format("{} keyframes, {} landmarks", keyframes, landmarks);
}

Status write_keyframes(Exporter& exporter, const AtomicFolder& folder) {
  const std::vector<storage::Submap> submaps = storage::submaps_of(exporter.map());
  for (std::size_t i = 0; i < submaps.size(); ++i) {
    const std::string name = submaps.size() == 1 ? "keyframes.tum" : fmt::format("keyframes_{}.tum", i);
    const auto trajectory = storage::keyframe_trajectory(exporter.map(), submaps[i]);
    exporter.note_equal_times(submaps[i].keyframes.size(), trajectory.size(), name);
    const std::string header =
        evaluation::trajectory_header("cam0", evaluation::PoseState::kFinal, evaluation::world_of_submap(i));
    if (Status s = folder.write(name, evaluation::tum_text(trajectory, header)); !s) return s;
  }
  return {};
}

// The absolute path of a file, without symbolic links in its folders; the file itself may be a link.
fs::path without_links(const fs::path& file) {
  std::error_code error;
  const fs::path absolute = fs::absolute(file), folder = fs::weakly_canonical(absolute.parent_path(), error);
  return (error ? absolute.parent_path() : folder) / absolute.filename();
}

// file_path of every image: images/NAME if it is undistorted, is not a file of its own, or is not in the recording;
// otherwise the path of the recorded file relative to the folder of the export, or, if that is a link, to the folder
// that it leads to.
std::vector<std::string> nerfstudio_paths(const Exporter& exporter) {
  std::vector<std::string> paths;
  const fs::path out = without_links(exporter.request.out / "transforms.json").parent_path();
  for (const MapImage& image : exporter.images.images()) {
    const bool is_file = image.recorded && !image.recorded->path.empty();
    const bool in_folder = !is_file || exporter.cameras.undistorted();
    paths.push_back(in_folder ? "images/" + image.name
                              : without_links(image.recorded->path).lexically_relative(out).string());
  }
  return paths;
}

// Writes rig.yaml: without masks, and with the extrinsics before the first move of a camera.
Status write_rig(Exporter& exporter, const camera::Rig& rig, const AtomicFolder& folder) {
  if (!exporter.map().rig().moves().empty())
    exporter.note("a camera was moved during the recording; rig.yaml has its extrinsics before that");
  return folder.write("rig.yaml", rig_formats::rig_to_yaml(rig_formats::without(rig, rig_formats::Droppable::kMasks)));
}

// The undistorted image as the bytes of a PNG file; nullopt if there is no recorded image, it cannot be read, or its
// size differs from the camera's.
std::optional<std::string> undistorted_png(Exporter& exporter, const MapImage& image) {
  if (!image.recorded) return std::nullopt;
  const camera::Camera& camera = exporter.map().rig().camera(image.camera);
  const auto colours = image_decoding::read_colours(*image.recorded, image.format);
  if (!colours || colours->cols != camera.width || colours->rows != camera.height) return std::nullopt;
  return image_decoding::encode_png(exporter.cameras.image(image.camera, *colours));
}

Result<AtomicFolder> folder_of(const Exporter& exporter) {
  if (Status s = not_interrupted(exporter.request.interrupted); !s) return s.error();
  return AtomicFolder::create(exporter.request.out, exporter.request.overwrite);
}

Status write_colmap(const ColmapModel& model, Exporter& exporter, const AtomicFolder& folder) {
  for (const std::string& note : model.notes) exporter.note(note);
  const std::size_t all = exporter.selection.landmarks.size();
  if (model.landmarks < all)
    exporter.note(fmt::format("{} of {} landmarks are not in points3D.txt, because no image of the model shows them",
                              all - model.landmarks, all));
  return write_files(model, folder);
}

}  // namespace

Status write_undistorted(Exporter& exporter, const AtomicFolder& folder) {
  std::size_t unread = 0;
  std::vector<std::uint8_t> written;
  exporter.images.set_extensions(".png");
  for (const MapImage& image : exporter.images.images()) {
    if (Status s = not_interrupted(exporter.request.interrupted); !s) return s;
    const std::optional<std::string> png = undistorted_png(exporter, image);
    written.push_back(png.has_value());
    unread += image.recorded && !png;
    if (!png) continue;
    if (Status s = folder.write(fs::path("images") / image.name, *png); !s) return s;
  }
  exporter.images.keep(written);
  if (exporter.images.images().empty())
    return Error{exporter.request.data_folder.string(), "--images", "no image of the map that can be read",
                 "the recording from which the map was made"};
  if (unread > 0)
    exporter.note(fmt::format("{} of {} images could not be read; they are left out", unread, written.size()));
  std::vector<camera::RigCamera> cameras;
  for (std::size_t c = 0; c < exporter.map().rig().size(); ++c)
    cameras.push_back({exporter.cameras.camera(c), exporter.map().rig().body_from_cam(c)});
  return write_rig(exporter, camera::Rig(std::move(cameras), exporter.map().rig().cam_from_rig(0)), folder);
}

Status export_colmap(Exporter& exporter) {
  const LandmarkColours colours = exporter.colours();
  auto folder = folder_of(exporter);
  if (!folder) return folder.error();
  if (!exporter.request.data) exporter.note("the images are named CAMERA/STAMP.png: --images DATA names their files");
  if (exporter.cameras.undistorted())
    if (Status s = write_undistorted(exporter, *folder); !s) return s;
  const auto model = colmap_model(exporter.selection, exporter.images, exporter.cameras, colours);
  if (!model) return model.error();
  if (Status s = write_colmap(*model, exporter, *folder); !s) return s;
  exporter.report.summary =
      fmt::format("{} images, {}, mean reprojection error {:.2f} px", exporter.images.images().size(),
                  counts(exporter.selection.keyframes.size(), model->landmarks), model->mean_error_px);
  return folder->commit();
}

Status export_nerfstudio(Exporter& exporter) {
  const LandmarkColours colours = exporter.colours();
  auto folder = folder_of(exporter);
  if (!folder) return folder.error();
  if (!exporter.request.data)
    exporter.note(
        "the images are expected as images/CAMERA/STAMP.png beside transforms.json: --images DATA names their "
        "files");
  if (exporter.cameras.undistorted())
    if (Status s = write_undistorted(exporter, *folder); !s) return s;
  const auto json =
      nerfstudio_json(exporter.selection, exporter.images, exporter.cameras, nerfstudio_paths(exporter), "points.ply");
  if (!json) return json.error();
  const std::string ply = landmarks_ply(exporter.selection, colours, exporter.selection.T_upright_world);
  if (Status s = folder->write("transforms.json", *json); !s) return s;
  if (Status s = folder->write("points.ply", ply); !s) return s;
  exporter.note_upward();
  exporter.report.summary =
      fmt::format("{} images, {}", exporter.images.images().size(),
                  counts(exporter.selection.keyframes.size(), exporter.selection.landmarks.size()));
  return folder->commit();
}

Status export_folder(Exporter& exporter) {
  const LandmarkColours colours = exporter.colours();
  auto folder = folder_of(exporter);
  if (!folder) return folder.error();
  if (Status s = folder->write("points.ply", landmarks_ply(exporter.selection, colours)); !s) return s;
  if (Status s = write_rig(exporter, exporter.map().rig(), *folder); !s) return s;
  if (Status s = write_keyframes(exporter, *folder); !s) return s;
  const auto model = colmap_model(exporter.selection, exporter.images, exporter.cameras, colours);
  if (model) {
    if (Status s = write_colmap(*model, exporter, *folder); !s) return s;
  } else {  // the other files are still useful
    exporter.note("no COLMAP model was written: " + model.error().message());
  }
  exporter.report.summary = counts(exporter.map().num_keyframes(), exporter.selection.landmarks.size());
  return folder->commit();
}

}  // namespace bslam::map_export
