// Prints the content of a saved map. Usage: read_map MAP [POINTS.xyz]
#include <bslam/bslam.h>

#include <fstream>
#include <iostream>

int main(int argc, char** argv) {
  if (argc < 2) return std::cerr << "read_map MAP [POINTS.xyz]\n", 1;
  const auto map = bslam::MapView::load(argv[1]);
  if (!map) return std::cerr << map.error().message() << '\n', 1;

  std::cout << map->rig().size() << " cameras, scale " << to_string(map->scale()) << '\n';
  std::cout << map->num_keyframes() << " keyframes in " << map->submaps().size() << " submaps, " << map->num_landmarks()
            << " landmarks\n";
  for (const auto& keyframe : map->keyframes()) {
    const auto& t = keyframe.T_world_cam0.translation;
    std::cout << keyframe.time_ns << "  " << t[0] << ' ' << t[1] << ' ' << t[2] << "  parent " << keyframe.parent
              << '\n';
  }
  std::cout << map->covisibility(30).size() << " pairs of keyframes share 30 landmarks or more\n";

  if (argc < 3) return 0;
  std::ofstream points(argv[2]);
  for (const auto& landmark : map->landmarks()) {
    if (landmark.observations < 3) continue;
    points << landmark.position[0] << ' ' << landmark.position[1] << ' ' << landmark.position[2] << '\n';
  }
  return points ? 0 : 1;
}
