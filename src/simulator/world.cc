#include "simulator/world.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

#include "base/assert.h"
#include "simulator/embree.h"
#include "simulator/texel.h"

namespace bslam::simulator {
namespace {

constexpr float kAmbient = 0.42f;      // ambient light before occlusion by nearby surfaces
constexpr double kAmbientReach = 1.2;  // metres within which surfaces occlude ambient light
constexpr double kLampRadius = 0.14;   // metres; determines the softness of shadows
constexpr double kOffSurface = 0.006;  // metres between a surface and the origin of rays that start on it
constexpr double kMinLight = 0.012;    // minimum irradiance by a lamp for which its shadow is computed
const Vector3d kLampPoints[] = {{1, 0.2, 0}, {-0.3, 0.9, 0.1}, {-0.9, -0.4, -0.1}, {0.2, -0.9, 0}, {0, 0, -0.2}};
constexpr float kLampLight = 2.2f, kDaylight = 0.75f, kSkyLight = 0.95f;
constexpr double kSunReach = 80.0;     // metres within which surfaces cast shadows of the sun
constexpr double kLeastCoarse = 0.25;  // metres: texels of surfaces that seem to be hidden by others are larger
constexpr double kCoarser = 4.0;       // factor on the texels of surfaces that seem to be hidden by others
constexpr double kCoarsest = 4.0;      // largest texel size relative to the smallest, except far away

// The light of materials that emit it.
std::optional<float> uniform_light(Material material) {
  if (material == Material::kLamp) return kLampLight;
  if (material == Material::kWindow) return kDaylight;
  if (material == Material::kSky || material == Material::kHorizon || material == Material::kHills) return kSkyLight;
  return std::nullopt;
}

Vector3d unit_normal(const Surface& s) { return s.u.cross(s.v).normalized(); }

// Returns the level of the texture pyramid for a footprint of `texels` finest texels: floor(log2).
int level_of(float texels, int levels) {
  const int exponent = static_cast<int>(std::bit_cast<std::uint32_t>(texels) >> 23) - 127;
  return std::clamp(exponent, 0, levels - 1);
}

RTCRay make_ray(const Vector3d& origin, const Vector3d& direction, double near, double far) {
  RTCRay ray{};
  ray.org_x = static_cast<float>(origin.x());
  ray.org_y = static_cast<float>(origin.y());
  ray.org_z = static_cast<float>(origin.z());
  ray.dir_x = static_cast<float>(direction.x());
  ray.dir_y = static_cast<float>(direction.y());
  ray.dir_z = static_cast<float>(direction.z());
  ray.tnear = static_cast<float>(near);
  ray.tfar = static_cast<float>(far);
  ray.mask = ~0u;
  return ray;
}

}  // namespace

// Owns the handles of Embree. There is one quad per surface in the same order, so that primID is the index of the
// surface.
struct World::Scene {
  explicit Scene(const std::vector<Surface>& surfaces) : device(rtcNewDevice("threads=1,set_affinity=0")) {
    BSLAM_ASSERT(device != nullptr, "Embree must provide a device");
    scene = rtcNewScene(device);
    rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
    rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_HIGH);
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_QUAD);
    auto* vertex = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                               3 * sizeof(float), 4 * surfaces.size()));
    auto* index = static_cast<std::uint32_t*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT4, 4 * sizeof(std::uint32_t), surfaces.size()));
    std::uint32_t next = 0;
    for (const Surface& s : surfaces) {
      for (const Vector3d& corner :
           {s.origin, Vector3d(s.origin + s.u), Vector3d(s.origin + s.u + s.v), Vector3d(s.origin + s.v)}) {
        for (int i = 0; i < 3; ++i) *vertex++ = static_cast<float>(corner[i]);
        *index++ = next++;
      }
    }
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(scene);
  }
  ~Scene() {
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
  }
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;

  RTCDevice device;
  RTCScene scene = nullptr;
};

// How far the albedo and the light of a surface are computed. Its rows are divided into parts.
struct World::Baking {
  static constexpr std::int32_t kRows = 64;      // rows of texels per part
  std::atomic<std::int32_t> next = 0, done = 0;  // parts
  std::atomic<bool> ready = false;
};

World::World(Building building, const WorldOptions& options, ThreadPool& pool)
    : building_(std::move(building)), ambient_rays_(options.ambient_rays) {
  scene_ = std::make_unique<Scene>(building_.surfaces);
  lay_out(options, pool);
  baking_ = std::make_unique<Baking[]>(baked_.size());
}

World::~World() = default;
World::World(World&&) noexcept = default;
World& World::operator=(World&&) noexcept = default;

bool World::hidden_by_others(const Surface& s) const {
  constexpr std::size_t kPlaces = 16;  // number of sampled places of the tour
  constexpr std::array<std::array<double, 2>, 5> kPoints = {
      {{0.5, 0.5}, {0.1, 0.9}, {0.9, 0.9}, {0.1, 0.1}, {0.9, 0.1}}};
  const std::size_t step = std::max<std::size_t>(1, building_.tour.size() / kPlaces);
  const Vector3d n = unit_normal(s);
  for (const auto& [a, b] : kPoints) {
    const Vector3d point = s.origin + a * s.u + b * s.v + kOffSurface * n;
    for (std::size_t i = 0; i < building_.tour.size(); i += step) {
      const Vector2d& place = building_.tour[i];
      const Vector3d eye(place.x(), place.y(), 0.5 * (Building::kTourLow + Building::kTourHigh));
      if ((eye - point).dot(n) > 0 && !blocked(point, eye)) return false;
    }
  }
  return true;
}

std::vector<std::optional<double>> World::texel_sizes(const WorldOptions& options, ThreadPool& pool) const {
  std::vector<std::optional<double>> sizes(building_.surfaces.size());
  constexpr std::size_t kTogether = 256;  // surfaces
  pool.for_each((sizes.size() + kTogether - 1) / kTogether, [&](std::size_t part) {
    for (std::size_t i = part * kTogether; i < std::min(sizes.size(), (part + 1) * kTogether); ++i)
      sizes[i] = texel_of(building_.surfaces[i], options);
  });
  return sizes;
}

std::optional<double> World::texel_of(const Surface& s, const WorldOptions& options) const {
  constexpr double kFar = 10.0;  // metres; surfaces of the indoor worlds are nearer
  const Vector3d n = unit_normal(s);
  bool seen = building_.tour.empty();
  double nearest = seen ? 0.0 : std::numeric_limits<double>::infinity();
  for (const Vector2d& place : building_.tour) {
    for (const double z : {Building::kTourLow, Building::kTourHigh}) {
      const Vector3d d = Vector3d(place.x(), place.y(), z) - s.origin;
      constexpr double kRoom = 2 * Building::kTourSway;  // metres; cameras may be this far from the tour
      if (d.dot(n) < -kRoom) continue;
      seen = true;
      const double a = std::clamp(d.dot(s.u) / s.u.squaredNorm(), 0.0, 1.0);
      const double b = std::clamp(d.dot(s.v) / s.v.squaredNorm(), 0.0, 1.0);
      nearest = std::min(nearest, (d - a * s.u - b * s.v).norm());
    }
  }
  if (!seen) return std::nullopt;
  const double farthest = nearest > kFar ? std::numeric_limits<double>::infinity() : kCoarsest * options.texel;
  const double texel = std::max(std::clamp(options.texel_per_distance * nearest, options.texel, farthest), s.min_texel);
  const bool uncertain = options.hiding_distance > 0 && nearest > options.hiding_distance;
  return uncertain && hidden_by_others(s) ? std::max(kCoarser * texel, kLeastCoarse) : texel;
}

void World::lay_out(const WorldOptions& options, ThreadPool& pool) {
  std::uint32_t texels = 0, samples = 0;
  const std::vector<std::optional<double>> sizes = texel_sizes(options, pool);
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    const Surface& s = building_.surfaces[i];
    Baked b{};
    b.normal = unit_normal(s).cast<float>();
    const double w = s.u.norm(), h = s.v.norm();
    const double texel = sizes[i].value_or(options.hidden_texel);
    b.hidden = !sizes[i].has_value();
    b.samples = b.hidden || uniform_light(s.texture.material) ? 1 : samples_per_texel(options.sample_spacing, texel);
    b.texels_per_m = static_cast<float>(1 / texel);
    b.width = std::max(1, static_cast<std::int32_t>(std::lround(w / texel)));
    b.height = std::max(1, static_cast<std::int32_t>(std::lround(h / texel)));
    for (b.levels = 0; b.levels < kLevels; ++b.levels) {
      const std::int32_t lw = ((b.width - 1) >> b.levels) + 1, lh = ((b.height - 1) >> b.levels) + 1;
      b.texel[b.levels] = texels;
      texels += static_cast<std::uint32_t>(lw * lh);
      if (lw == 1 && lh == 1) {
        ++b.levels;
        break;
      }
    }
    const bool uniform = b.hidden || uniform_light(s.texture.material).has_value();
    const double light_texel = options.light_texel * std::max(1.0, texel / (kCoarsest * options.texel));
    b.light_width = 2 + (uniform ? 0 : static_cast<std::int32_t>(w / light_texel));
    b.light_height = 2 + (uniform ? 0 : static_cast<std::int32_t>(h / light_texel));
    b.light = samples;
    samples += static_cast<std::uint32_t>(b.light_width * b.light_height);
    baked_.push_back(b);
  }
  texels_.resize(texels);
  light_.resize(samples);
}

const World::Baked& World::baked(std::size_t surface) const {
  Baking& baking = baking_[surface];
  if (!baking.ready.load(std::memory_order_acquire)) bake(surface, baking);
  return baked_[surface];
}

void World::bake(std::size_t surface, Baking& baking) const {
  const Baked& b = baked_[surface];
  const std::int32_t parts = (b.height + Baking::kRows - 1) / Baking::kRows;
  for (std::int32_t part = baking.next++; part < parts; part = baking.next++) {
    bake_albedo(surface, part * Baking::kRows, std::min((part + 1) * Baking::kRows, b.height));
    bake_light(surface, part * b.light_height / parts, (part + 1) * b.light_height / parts);
    if (++baking.done < parts) continue;
    build_pyramid(b);
    baking.ready.store(true, std::memory_order_release);
    baking.ready.notify_all();
  }
  baking.ready.wait(false, std::memory_order_acquire);
}

void World::bake_albedo(std::size_t surface, std::int32_t from, std::int32_t to) const {
  const Surface& s = building_.surfaces[surface];
  const Baked& b = baked_[surface];
  const Vector2f size(static_cast<float>(s.u.norm()), static_cast<float>(s.v.norm()));
  const Vector2f texels(static_cast<float>(b.width), static_cast<float>(b.height));
  for (std::int32_t y = from; y < to; ++y) {
    std::uint8_t* out = texels_.data() + b.texel[0] + static_cast<std::size_t>(y) * static_cast<std::size_t>(b.width);
    for (std::int32_t x = 0; x < b.width; ++x) {
      const float mean = mean_albedo(s, static_cast<float>(x), static_cast<float>(y), size, texels, b.samples);
      out[x] = static_cast<std::uint8_t>(255.0f * std::sqrt(mean) + 0.5f);
    }
  }
}

void World::build_pyramid(const Baked& b) const {
  for (std::int32_t level = 1; level < b.levels; ++level) {
    const TexelGrid fine{((b.width - 1) >> (level - 1)) + 1, ((b.height - 1) >> (level - 1)) + 1};
    const TexelGrid coarse{((b.width - 1) >> level) + 1, ((b.height - 1) >> level) + 1};
    halve(texels_.data() + b.texel[level - 1], fine, texels_.data() + b.texel[level], coarse);
  }
}

void World::bake_light(std::size_t surface, std::int32_t from, std::int32_t to) const {
  const Surface& s = building_.surfaces[surface];
  const Baked& b = baked_[surface];
  const Vector3d normal = unit_normal(s);
  std::optional<float> constant = uniform_light(s.texture.material);
  if (b.hidden && !constant) constant = kAmbient;
  // Samples are slightly inside the edges, so that neighbouring surfaces do not cover them.
  const auto inset = [](std::int32_t k, std::int32_t count) {
    return std::clamp(static_cast<double>(k) / (count - 1), 0.02, 0.98);
  };
  for (std::int32_t y = from; y < to; ++y) {
    for (std::int32_t x = 0; x < b.light_width; ++x) {
      const Vector3d point = s.origin + inset(x, b.light_width) * s.u + inset(y, b.light_height) * s.v;
      light_[b.light + static_cast<std::size_t>(y * b.light_width + x)] =
          constant ? *constant : light_at(point, normal);
    }
  }
}

float World::light_at(const Vector3d& point, const Vector3d& n) const {
  // All samples use the same pattern of rays, since noise between samples would be visible as stains.
  const Vector3d start = point + kOffSurface * n;
  double light = 0;
  for (const Lamp& lamp : building_.lamps) {
    const Vector3d to = lamp.position - start;
    const double distance2 = to.squaredNorm(), facing = to.dot(n) / std::sqrt(distance2);
    const double unshadowed = lamp.intensity * facing / (distance2 + 0.35);
    if (unshadowed < kMinLight) continue;
    int open = 0;
    for (const Vector3d& offset : kLampPoints) open += blocked(start, lamp.position + kLampRadius * offset) ? 0 : 1;
    light += unshadowed * open / static_cast<double>(std::size(kLampPoints));
  }
  if (building_.sun) {
    const double facing = building_.sun->direction.dot(n);
    const bool lit = facing > 0 && !blocked(start, start + kSunReach * building_.sun->direction);
    if (lit) light += building_.sun->irradiance * facing;
  }
  int open = 0;
  const Vector3d side = n.unitOrthogonal(), up = n.cross(side);
  for (int k = 0; k < ambient_rays_; ++k) {  // cosine-weighted directions on a Fibonacci spiral
    const double r2 = (k + 0.5) / ambient_rays_, r = std::sqrt(r2), angle = 2.399963 * k;
    const Vector3d d = r * std::cos(angle) * side + r * std::sin(angle) * up + std::sqrt(1 - r2) * n;
    if (!blocked(start, start + kAmbientReach * d)) ++open;
  }
  const double enclosed = ambient_rays_ > 0 ? static_cast<double>(open) / ambient_rays_ : 1.0;
  return static_cast<float>(light + kAmbient * (0.25 + 0.75 * enclosed));
}

bool World::blocked(const Vector3d& from, const Vector3d& to) const {
  RTCRay ray = make_ray(from, to - from, 0.0, 1.0);
  occluded(scene_->scene, ray);
  return ray.tfar < 0;
}

std::optional<Hit> World::cast(const Vector3d& origin, const Vector3d& direction) const {
  RTCRayHit query{};
  query.ray = make_ray(origin, direction, 0.0, 1e6);
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  intersect(scene_->scene, query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
  // Embree uses floats. Position and distance are computed in doubles from the plane of the surface.
  const Surface& s = building_.surfaces[query.hit.primID];
  const Vector3d n = s.u.cross(s.v);
  const double distance = (s.origin - origin).dot(n) / direction.dot(n);
  const Vector3d d = origin + distance * direction - s.origin;
  return Hit{query.hit.primID, std::clamp(d.dot(s.u) / s.u.squaredNorm(), 0.0, 1.0),
             std::clamp(d.dot(s.v) / s.v.squaredNorm(), 0.0, 1.0), distance};
}

float World::lookup(const Baked& b, float a, float v, int level) const {
  const std::int32_t w = ((b.width - 1) >> level) + 1, h = ((b.height - 1) >> level) + 1;
  const float shrink = std::bit_cast<float>(static_cast<std::uint32_t>(127 - level) << 23);  // 2^-level
  const float x = std::max(0.0f, a * static_cast<float>(b.width) * shrink - 0.5f);
  const float y = std::max(0.0f, v * static_cast<float>(b.height) * shrink - 0.5f);
  const std::int32_t x0 = std::min(static_cast<std::int32_t>(x), w - 1),
                     y0 = std::min(static_cast<std::int32_t>(y), h - 1);
  const float fx = x - static_cast<float>(x0), fy = y - static_cast<float>(y0);
  const std::int32_t right = x0 + 1 < w ? 1 : 0, below = y0 + 1 < h ? w : 0;
  const std::uint8_t* t = texels_.data() + b.texel[level] + y0 * w + x0;
  const float top = static_cast<float>(t[0]) + fx * static_cast<float>(t[right] - t[0]);
  const float bottom = static_cast<float>(t[below]) + fx * static_cast<float>(t[below + right] - t[below]);
  const float root = (top + fy * (bottom - top)) * (1.0f / 255.0f);

  const float lx = a * static_cast<float>(b.light_width - 1), ly = v * static_cast<float>(b.light_height - 1);
  const std::int32_t i = std::min(static_cast<std::int32_t>(lx), b.light_width - 2);
  const std::int32_t j = std::min(static_cast<std::int32_t>(ly), b.light_height - 2);
  const float gx = lx - static_cast<float>(i), gy = ly - static_cast<float>(j);
  const float* l = light_.data() + b.light + j * b.light_width + i;
  const float upper = l[0] + gx * (l[1] - l[0]);
  const float lower = l[b.light_width] + gx * (l[b.light_width + 1] - l[b.light_width]);
  return root * root * (upper + gy * (lower - upper));
}

float World::radiance(const Hit& hit, double footprint) const {
  const Baked& b = baked(hit.surface);
  return lookup(b, static_cast<float>(hit.a), static_cast<float>(hit.b),
                level_of(static_cast<float>(footprint) * b.texels_per_m, b.levels));
}

void World::radiance(const Eigen::Vector3f& origin, const RayPacket& rays, float spread, float detail,
                     float* out) const {
  constexpr int kN = RayPacket::kSize;
  alignas(32) static constexpr int kAllValid[kN] = {-1, -1, -1, -1, -1, -1, -1, -1};  // Embree requires the alignment
  alignas(32) RTCRayHit8 query;
  for (int i = 0; i < kN; ++i) {
    query.ray.org_x[i] = origin.x();
    query.ray.org_y[i] = origin.y();
    query.ray.org_z[i] = origin.z();
    query.ray.dir_x[i] = rays.x[i];
    query.ray.dir_y[i] = rays.y[i];
    query.ray.dir_z[i] = rays.z[i];
    query.ray.tnear[i] = 0;
    query.ray.tfar[i] = 1e6f;
    query.ray.time[i] = 0;
    query.ray.mask[i] = ~0u;
    query.ray.flags[i] = 0;
    query.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
    query.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
  }
  intersect_coherent(kAllValid, scene_->scene, query);
  const float scale = spread * std::exp2(detail);
  for (int i = 0; i < kN; ++i) {
    if (query.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID) {
      out[i] = 0.02f;
      continue;
    }
    const Baked& b = baked(query.hit.primID[i]);
    const float cosine = std::abs(b.normal.x() * rays.x[i] + b.normal.y() * rays.y[i] + b.normal.z() * rays.z[i]);
    // The footprint of an oblique ray is longer in one direction; its geometric mean is used.
    const float texels = query.ray.tfar[i] * scale * b.texels_per_m / std::sqrt(std::max(cosine, 0.02f));
    out[i] = lookup(b, query.hit.u[i], query.hit.v[i], level_of(texels, b.levels));
  }
}

}  // namespace bslam::simulator
