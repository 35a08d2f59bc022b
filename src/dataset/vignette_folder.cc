#include "dataset/vignette_folder.h"

#include <fmt/format.h>

#include <system_error>

namespace bslam::dataset {

namespace fs = std::filesystem;

Result<std::vector<image_decoding::Vignette>> read_vignettes(const camera::Rig& rig, const std::vector<int>& cameras,
                                                             const fs::path& folder) {
  std::vector<image_decoding::Vignette> vignettes(rig.size());
  bool any = false;
  for (std::size_t i = 0; i < rig.size(); ++i) {
    const fs::path file = folder / fmt::format("cam{}.png", cameras[i]);
    if (std::error_code error; !fs::exists(file, error)) continue;
    auto vignette = image_decoding::Vignette::read(file, rig.camera(i));
    if (!vignette) return vignette.error();
    vignettes[i] = *std::move(vignette);
    any = true;
  }
  if (any) return vignettes;
  return Error{folder.string(), "--vignettes", "no vignette of a camera in use",
               fmt::format("cam{}.png or that of another camera", cameras.front())};
}

}  // namespace bslam::dataset
