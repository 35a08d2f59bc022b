// Procedural materials of the surfaces of the built-in world. The patterns never repeat.
#pragma once

#include <cstdint>

namespace bslam::simulator {

enum class Material {
  kPlain,      // uniform
  kPlaster,    // stains, cracks, speckle, holes
  kWallpaper,  // scattered motifs of many shapes
  kBrick,
  kTile,       // square tiles, some of them with a motif
  kPlanks,     // floor boards of random length
  kWood,       // grain and knots
  kCarpet,     // woven patterns
  kCeiling,    // panels with stains and holes
  kPoster,     // frame, large shapes, lines of glyphs
  kWindow,     // frame and the view outside
  kBook,       // a spine with bands and glyphs
  kCardboard,  // tape, labels, dents
  kFabric,     // checks and folds
  kLeaves,     // foliage and grass
  kLamp,       // emits light
  kSky,        // clouds over tens of metres; emits light
  kHorizon,    // hills with houses and trees below the sky; emits light
  kHills,      // like kHorizon, but higher and for larger distances
  kAsphalt,    // stains, stones, cracks
  kPaving,     // slabs with joints
};

struct Texture {
  Material material = Material::kPlain;
  std::uint32_t seed = 0;
  float shade = 0.5f;  // approximate mean albedo
};

// Albedo in [0.03, 0.95] at position (x, y) of a surface of size `width` x `height`, in metres. Posters, windows and
// books fill their surface; the other patterns are unbounded.
float albedo(const Texture& texture, float x, float y, float width, float height);

}  // namespace bslam::simulator
