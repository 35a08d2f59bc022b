// The lit, textured world that rays are cast into: geometry in Embree, albedo baked with its pyramid, light baked.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <vector>

#include "base/thread_pool.h"
#include "simulator/building.h"

namespace bslam::simulator {

struct WorldOptions {
  double texel = 0.005;       // metres a texel spans near the tour; surfaces farther from it have coarser ones
  double light_texel = 0.10;  // metres between samples of the light
  int ambient_rays = 24;      // rays a light sample sends out to find how enclosed it is
};

// Where a ray met a surface: at origin + a u + b v of surface `surface`.
struct Hit {
  std::size_t surface;
  double a, b;
  double distance;  // metres
};

// Eight rays of one origin; directions are unit vectors, world frame.
struct RayPacket {
  static constexpr int kSize = 8;
  alignas(32) float x[kSize], y[kSize], z[kSize];
};

class World {
 public:
  // Builds and bakes everything with the threads of `pool`; what comes out does not depend on their number. Asked to
  // stop it is there soon, unfinished and of no use.
  World(Building building, const WorldOptions& options, ThreadPool& pool, std::stop_token stop = {});
  ~World();
  World(World&&) noexcept;
  World& operator=(World&&) noexcept;

  const Building& building() const { return building_; }

  // First surface a ray meets; empty where it leaves the world. `direction` is a unit vector.
  std::optional<Hit> cast(const Vector3d& origin, const Vector3d& direction) const;

  // Light a surface sends back at a place, averaged over `footprint` metres; 0.15 is about mid grey.
  float radiance(const Hit& hit, double footprint) const;

  // The same for eight rays at once: what comes from where they end, averaged over `spread` radians of each ray.
  // `detail` in [0, 1) decides between two texture levels, so that averaging over evenly spread details blends them.
  // Safe to call from many threads.
  void radiance(const Eigen::Vector3f& origin, const RayPacket& rays, float spread, float detail, float* out) const;

 private:
  struct Scene;
  static constexpr int kLevels = 10;

  // Baked data of one surface within the shared arrays.
  struct Baked {
    Eigen::Vector3f normal;
    std::int32_t width, height;  // texels of the finest level
    float texels_per_m;
    bool hidden;  // not to be seen from anywhere on the tour: without detail or shadows
    std::int32_t levels;
    std::uint32_t texel[kLevels];            // first texel of each level
    std::int32_t light_width, light_height;  // samples, on the edges too
    std::uint32_t light;                     // first sample
  };

  // Metres a texel of a surface may span; nothing where the surface turns its back on all of the tour.
  std::optional<double> texel_of(const Surface& surface, double finest) const;
  void lay_out(const WorldOptions& options);
  void bake_albedo(ThreadPool& pool, const std::stop_token& stop);
  void bake_light(const WorldOptions& options, ThreadPool& pool, const std::stop_token& stop);
  // Light that arrives at a point of a surface with normal `n`.
  float light_at(const Vector3d& point, const Vector3d& n, int ambient_rays) const;
  bool blocked(const Vector3d& from, const Vector3d& to) const;
  float lookup(const Baked& baked, float a, float b, int level) const;

  Building building_;
  std::vector<Baked> baked_;
  std::vector<std::uint8_t> texels_;  // 255 * sqrt(albedo)
  std::vector<float> light_;
  std::unique_ptr<Scene> scene_;
};

}  // namespace bslam::simulator
