// Procedural materials: what a surface of the built-in world looks like. No two places look alike.
#pragma once

#include <cstdint>

namespace bslam::simulator {

enum class Material {
  kPlain,      // one shade
  kPlaster,    // stains, cracks, speckle, holes
  kWallpaper,  // scattered motifs of many shapes
  kBrick,
  kTile,       // square tiles, some with a motif
  kPlanks,     // floor boards of random length
  kWood,       // grain and knots
  kCarpet,     // woven figures
  kCeiling,    // panels with stains and holes
  kPoster,     // frame, large shapes, lines of glyphs
  kWindow,     // frame and the view outside
  kBook,       // a spine with bands and glyphs
  kCardboard,  // tape, labels, dents
  kFabric,     // checks and folds
  kLamp,       // bright by itself
};

struct Texture {
  Material material = Material::kPlain;
  std::uint32_t seed = 0;
  float shade = 0.5f;  // mean albedo, about
};

// Albedo in [0.03, 0.95] at the place (x, y), metres, of a surface `width` x `height` metres large. Posters, windows
// and books fill their surface; the other patterns go on without end.
float albedo(const Texture& texture, float x, float y, float width, float height);

}  // namespace bslam::simulator
