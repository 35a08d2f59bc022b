// Runs SLAM on a recorded data set in EuRoC layout. Usage: recorded DATA TRAJECTORY.tum [MAP]
#include <bslam/bslam.h>

#include <iostream>
#include <set>

#include "euroc_images.h"

namespace {

int fail(const bslam::Error& error) {
  std::cerr << error.message() << '\n';
  return 1;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) return fail({"recorded", "", "too few arguments", "DATA TRAJECTORY.tum [MAP]"});
  const std::string data = argv[1];
  const auto rig = bslam::Rig::load(data);
  if (!rig) return fail(rig.error());

  bslam::Config config;
  config.set_mode(bslam::Mode::kSequential);  // identical results on every run
  auto slam = bslam::System::create(*rig, config);
  if (!slam) return fail(slam.error());

  std::vector<std::map<std::int64_t, std::string>> files;
  std::set<std::int64_t> times;
  for (std::size_t c = 0; c < rig->size(); ++c) {
    files.push_back(list_images(data, c));
    for (const auto& [time_ns, file] : files[c]) times.insert(time_ns);
  }

  int tracked = 0;
  for (const std::int64_t time_ns : times) {  // the cameras of the data set are synchronised
    bslam::ImageBundle bundle;
    for (const auto& camera : files) {
      const auto image = camera.find(time_ns);
      bundle.images.push_back(image == camera.end() ? bslam::CameraImage{} : read_image(image->second, time_ns));
    }
    const auto frame = slam->process(bundle);
    if (!frame) return fail(frame.error());
    tracked += frame->tracking();
  }
  if (const auto done = slam->finish(); !done) return fail(done.error());
  std::cout << tracked << " of " << times.size() << " frames have a pose\n";

  const auto trajectory = slam->trajectory();
  if (!trajectory) return fail(trajectory.error());
  if (const auto s = bslam::write_tum(argv[2], *trajectory, bslam::RigFrame::kCamera0); !s) return fail(s.error());
  if (argc < 4) return 0;
  const auto saved = slam->save_map(argv[3]);
  return saved ? 0 : fail(saved.error());
}
