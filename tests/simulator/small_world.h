// The built-in world with few details, which is built in a fraction of a second.
#pragma once

#include "simulator/world.h"

namespace bslam::simulator {

inline World small_world(std::uint64_t seed, ThreadPool& pool) {
  return World(make_building(seed), {.texel = 0.03, .light_texel = 0.8, .ambient_rays = 2}, pool);
}

}  // namespace bslam::simulator
