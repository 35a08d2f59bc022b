// SLAM with live cameras: one thread per camera delivers images, and one thread runs SLAM and prints poses and the
// states of the cameras. Here the cameras replay a data set in EuRoC layout at SPEED times its recorded rate. Usage:
// live DATA [SPEED]
#include <bslam/bslam.h>

#include <chrono>
#include <iostream>
#include <thread>

#include "euroc_images.h"

int main(int argc, char** argv) {
  const std::string data = argc > 1 ? argv[1] : ".";
  const double speed = argc > 2 ? std::stod(argv[2]) : 1.0;
  const auto rig = bslam::Rig::load(data);
  if (!rig) return std::cerr << rig.error().message() << '\n', 1;

  bslam::Startup startup;
  startup.history_frames = 10000;  // poses of older frames are discarded
  startup.callbacks.log = [](bslam::LogLevel, std::string_view line) { std::cerr << line << '\n'; };
  startup.callbacks.camera = [](const bslam::CameraEvent& e) {  // the states of all cameras are also in FrameResult
    std::cout << "camera " << e.camera << ": " << to_string(e.now.state) << ' ' << e.now.reason << '\n';
  };
  auto slam = bslam::System::create(*rig, bslam::Config(), startup);
  if (!slam) return std::cerr << slam.error().message() << '\n', 1;

  bslam::SyncOptions options;
  options.on_drop = [](const bslam::DroppedImage& d) {
    std::cerr << "camera " << d.camera << ": " << d.time_ns << " dropped: " << to_string(d.reason) << '\n';
  };
  auto synchronizer = bslam::Synchronizer::create(*rig, options);
  if (!synchronizer) return std::cerr << synchronizer.error().message() << '\n', 1;

  const auto replay = [&](std::size_t camera) {  // on a robot, the callback of the camera driver calls push()
    const auto files = list_images(data, camera);
    const auto start = std::chrono::steady_clock::now();
    for (const auto& [time_ns, file] : files) {
      const std::chrono::duration<double, std::nano> due(double(time_ns - files.begin()->first) / speed);
      std::this_thread::sleep_until(start + std::chrono::duration_cast<std::chrono::nanoseconds>(due));
      const bslam::CameraImage image = read_image(file, time_ns);
      if (image.data != nullptr && !synchronizer->push(camera, image)) return;
    }
  };
  std::vector<std::thread> cameras;
  for (std::size_t c = 0; c < rig->size(); ++c) cameras.emplace_back(replay, c);
  std::thread end([&] {
    for (auto& camera : cameras) camera.join();
    if (const auto closed = synchronizer->close(); !closed) std::cerr << closed.error().message() << '\n';
  });

  int frames = 0, tracked = 0;
  while (const auto bundle = synchronizer->wait()) {
    const auto frame = slam->process(*bundle);
    if (!frame) std::cerr << frame.error().message() << '\n';
    if (frame && frame->frame % 10 == 0) {
      const auto& t = frame->T_world_body.translation;  // metres; valid while tracking
      std::cout << to_string(frame->status) << ": " << t[0] << ' ' << t[1] << ' ' << t[2] << '\n';
    }
    frames += frame.ok();
    tracked += frame && frame->tracking();
  }
  end.join();
  const auto finished = slam->finish();
  std::cout << tracked << " of " << frames << " frames have a pose, " << slam->map().num_keyframes() << " keyframes\n";
  return finished && tracked > 0 ? 0 : 1;
}
