// live DATA [SPEED]: SLAM with live cameras. One thread per camera delivers images, and the main thread runs SLAM and
// prints poses and states of cameras. Here the cameras replay a data set in EuRoC layout at SPEED times its rate.
#include <bslam/bslam.h>

#include <atomic>
#include <iostream>
#include <thread>

#include "euroc_images.h"

void print_pose(const bslam::FrameResult& frame) {
  const auto& t = frame.T_world_body.translation;  // metres if frame.scale is metric
  std::cout << "position " << t[0] << ' ' << t[1] << ' ' << t[2] << '\n';
}

int main(int argc, char** argv) {
  const std::string data = argc > 1 ? argv[1] : ".";
  const double speed = argc > 2 ? std::stod(argv[2]) : 1.0;
  const auto failed = [](const auto& result) { return std::cerr << result.error().message() << '\n', 1; };
  const auto rig = bslam::Rig::load(data);
  if (!rig) return failed(rig);

  bslam::Startup startup;
  startup.history_frames = 10000;  // poses of older frames are discarded
  // The states of all cameras are also in FrameResult.
  startup.callbacks.camera = [](const bslam::CameraEvent& e) {
    std::cout << "camera " << e.camera << ": " << to_string(e.now.state) << ' ' << e.now.reason << '\n';
  };
  auto slam = bslam::System::create(*rig, bslam::Config(), startup);
  if (!slam) return failed(slam);

  bslam::SyncOptions options;
  options.on_drop = [](const bslam::DroppedImage& d) {
    std::cerr << "camera " << d.camera << ": " << d.time_ns << " dropped: " << to_string(d.reason) << '\n';
  };
  auto synchronizer = bslam::Synchronizer::create(*rig, options);
  if (!synchronizer) return failed(synchronizer);
  std::atomic<std::size_t> delivering = rig->size();
  const auto replay = [&](std::size_t camera) {  // on a robot, the callback of the camera driver calls push()
    play_images(data, camera, speed, [&](const bslam::CameraImage& image) {
      if (const auto pushed = synchronizer->push(camera, image); !pushed) failed(pushed);
    });
    if (--delivering > 0) return;
    if (const auto closed = synchronizer->close(); !closed) failed(closed);  // which ends the loop below
  };
  std::vector<std::thread> cameras;
  for (std::size_t c = 0; c < rig->size(); ++c) cameras.emplace_back(replay, c);

  int tracked = 0;
  while (const auto bundle = synchronizer->wait()) {
    const auto frame = slam->process(*bundle);
    if (!frame) failed(frame);
    if (frame && frame->tracking() && ++tracked % 10 == 1) print_pose(*frame);
  }
  for (std::thread& camera : cameras) camera.join();
  const auto finished = slam->finish();
  std::cout << tracked << " frames with a pose, " << slam->map().num_keyframes() << " keyframes\n";
  return finished && tracked > 0 ? 0 : 1;
}
