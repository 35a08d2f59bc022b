// The textured and lit world for ray casting: geometry in Embree, and per surface a pyramid of albedo and a grid of
// light, which are computed when they are first looked up.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "base/thread_pool.h"
#include "simulator/building.h"

namespace bslam::simulator {

struct WorldOptions {
  double texel = 0.005;  // metres per texel near the tour; surfaces farther away have larger texels
  // Radians, angular texel size of farther surfaces: about one pixel of the default cameras.
  double texel_per_distance = 0.002;
  double light_texel = 0.10;   // metres between samples of the light
  int ambient_rays = 24;       // rays per light sample for ambient occlusion
  double hidden_texel = 0.25;  // metres per texel of surfaces that face away from the whole tour
  // Metres; larger texels are means of two samples of the albedo in each direction. 0: of one sample.
  double sample_spacing = 0;
  // Metres; surfaces farther from the tour have coarse texels if others hide them. 0: none.
  double hiding_distance = 0;
};

// Intersection of a ray with surface `surface`, at origin + a u + b v.
struct Hit {
  std::size_t surface;
  double a, b;
  double distance;  // metres
};

// Eight rays with a common origin. Directions are unit vectors in the world frame.
struct RayPacket {
  static constexpr int kSize = 8;
  alignas(32) float x[kSize], y[kSize], z[kSize];
};

class World {
 public:
  // Builds the scene with the threads of `pool`, whose number does not affect the result.
  World(Building building, const WorldOptions& options, ThreadPool& pool);
  ~World();
  World(World&&) noexcept;
  World& operator=(World&&) noexcept;

  const Building& building() const { return building_; }

  // Returns the first intersection of a ray, or nullopt if it leaves the world. `direction` is a unit vector.
  std::optional<Hit> cast(const Vector3d& origin, const Vector3d& direction) const;

  // Returns the radiance of a surface at a point, averaged over `footprint` metres. 0.15 is about medium grey. As the
  // function below, computes albedo and light of a surface first if nobody asked for it before.
  float radiance(const Hit& hit, double footprint) const;

  // Computes the radiance at the end of eight rays, averaged over `spread` radians around each. `detail` in [0, 1)
  // selects one of two texture levels; averaging over uniformly distributed values blends them. May be called from
  // several threads.
  void radiance(const Eigen::Vector3f& origin, const RayPacket& rays, float spread, float detail, float* out) const;

 private:
  struct Scene;
  struct Baking;
  static constexpr int kLevels = 10;

  // Position of the albedo and the light of a surface in the shared arrays.
  struct Baked {
    Eigen::Vector3f normal;
    std::int32_t width, height;  // texels of the finest level
    float texels_per_m;
    bool hidden;           // not visible from the tour, therefore without details and shadows
    std::int32_t samples;  // samples of the albedo per texel, in each direction
    std::int32_t levels;
    std::uint32_t texel[kLevels];            // first texel of each level
    std::int32_t light_width, light_height;  // numbers of samples, including those on the edges
    std::uint32_t light;                     // first sample
  };

  // Returns the texel size of a surface in metres, or nullopt if its visible side faces away from the whole tour.
  std::optional<double> texel_of(const Surface& surface, const WorldOptions& options) const;
  // Returns the texel sizes of all surfaces.
  std::vector<std::optional<double>> texel_sizes(const WorldOptions& options, ThreadPool& pool) const;
  // Whether no ray from some points of a surface reaches the tour.
  bool hidden_by_others(const Surface& surface) const;
  void lay_out(const WorldOptions& options, ThreadPool& pool);
  // The data of a surface, which are computed by the first call. Threads that need one surface share its rows.
  const Baked& baked(std::size_t surface) const;
  void bake(std::size_t surface, Baking& baking) const;
  void bake_albedo(std::size_t surface, std::int32_t from, std::int32_t to) const;  // rows of texels
  void bake_light(std::size_t surface, std::int32_t from, std::int32_t to) const;   // rows of samples
  void build_pyramid(const Baked& baked) const;
  // Irradiance at a point of a surface with normal `n`.
  float light_at(const Vector3d& point, const Vector3d& n) const;
  bool blocked(const Vector3d& from, const Vector3d& to) const;
  float lookup(const Baked& baked, float a, float b, int level) const;

  Building building_;
  int ambient_rays_;
  std::vector<Baked> baked_;
  std::unique_ptr<Baking[]> baking_;          // by surface
  mutable std::vector<std::uint8_t> texels_;  // 255 * sqrt(albedo); of baked surfaces
  mutable std::vector<float> light_;          // of baked surfaces
  std::unique_ptr<Scene> scene_;
};

}  // namespace bslam::simulator
