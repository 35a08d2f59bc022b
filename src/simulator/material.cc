#include "simulator/material.h"

#include <algorithm>
#include <cmath>

#include "simulator/noise.h"

namespace bslam::simulator {
namespace {

using Seed = std::uint32_t;

constexpr float kEdge = 0.004f;  // metres; width of the transition at painted edges

// A cell of a regular grid and a position in it.
struct Cell {
  std::int32_t column, row;
  float x, y;  // metres from the lower corner of the cell
};

Cell cell_at(float x, float y, float width, float height) {
  Cell c{floor_int(x / width), floor_int(y / height), 0, 0};
  c.x = x - static_cast<float>(c.column) * width;
  c.y = y - static_cast<float>(c.row) * height;
  return c;
}

// 1 inside a shape, where the signed distance is negative, with a soft edge.
float inside(float signed_distance) { return smooth_step(0.5f * kEdge, -0.5f * kEdge, signed_distance); }

float box_distance(float x, float y, float half_width, float half_height) {
  return std::max(std::abs(x) - half_width, std::abs(y) - half_height);
}

// Coverage in [0, 1] of a random shape around the origin that fits into a circle of `radius`.
float motif(float x, float y, float radius, Seed seed) {
  const float turn = 6.2832f * unit(hash(1, 0, seed)), c = std::cos(turn), s = std::sin(turn);
  const float u = c * x + s * y, v = c * y - s * x, r = std::sqrt(x * x + y * y);
  const float aspect = mix(0.35f, 0.8f, unit(hash(2, 0, seed)));
  switch (hash(3, 0, seed) % 7) {
    case 0:
      return inside(r - radius);
    case 1:
      return inside(std::abs(r - 0.75f * radius) - 0.22f * radius);
    case 2:
      return inside(box_distance(u, v, 0.7f * radius, 0.7f * aspect * radius));
    case 3:
      return std::max(inside(box_distance(u, v, 0.9f * radius, 0.2f * radius)),
                      inside(box_distance(u, v, 0.2f * radius, 0.9f * radius)));
    case 4:
      return inside(std::max(-v - 0.5f * radius, 0.866f * std::abs(u) + 0.5f * v - 0.5f * radius));
    case 5:
      return inside(std::max(r - radius, u - 0.1f * radius));
    default: {
      const float petals = 0.65f + 0.35f * std::cos(5.0f * std::atan2(v, u));
      return inside(r - radius * petals);
    }
  }
}

// Motifs scattered over cells of `size` metres: returns positive or negative coverage, and 0 between motifs.
float scattered_motifs(float x, float y, float size, float density, Seed seed) {
  const Cell c = cell_at(x, y, size, size);
  const Seed cell_seed = hash(c.column, c.row, seed);
  if (unit(hash(10, 0, cell_seed)) > density) return 0;
  const float radius = size * mix(0.12f, 0.36f, unit(hash(11, 0, cell_seed)));
  const float slack = 0.5f * size - radius;
  const float cx = 0.5f * size + slack * mix(-1, 1, unit(hash(12, 0, cell_seed)));
  const float cy = 0.5f * size + slack * mix(-1, 1, unit(hash(13, 0, cell_seed)));
  const float strength = mix(-1, 1, unit(hash(14, 0, cell_seed)));
  return motif(c.x - cx, c.y - cy, radius, cell_seed) * (strength < 0 ? strength - 0.4f : strength + 0.4f) / 1.4f;
}

// Imitates writing: cells of `height` metres with 5 x 7 random dots, grouped to words of random length. Returns 1 on a
// dot and 0 elsewhere.
float glyphs(float x, float y, float height, Seed seed) {
  const float width = 0.75f * height;
  const Cell c = cell_at(x, y, width, 1.6f * height);
  if (unit(hash(c.column, c.row, seed)) < 0.18f || c.y > height) return 0;
  const auto column = static_cast<std::int32_t>(c.x / width * 6), row = static_cast<std::int32_t>(c.y / height * 7);
  if (column == 5) return 0;
  return (hash(column, row, hash(c.column, c.row, seed + 1)) & 1u) ? 1.0f : 0.0f;
}

float speckle(float x, float y, Seed seed) { return value_noise(x * 140, y * 140, seed); }

float plaster(const Texture& t, float x, float y) {
  const float stains = fractal_noise(1.3f * x, 1.3f * y, t.seed, 4);
  const float grain = fractal_noise(22 * x, 22 * y, t.seed + 1, 3);
  const float ridge = std::abs(fractal_noise(1.7f * x, 1.7f * y, t.seed + 2, 3));
  const float crack = smooth_step(0.012f, 0.0f, ridge);
  float a = t.shade * (1 + 0.28f * stains + 0.20f * grain + 0.10f * speckle(x, y, t.seed + 3));
  a *= 1 + 0.75f * scattered_motifs(x, y, 0.09f, 0.30f, t.seed + 4) * smooth_step(-0.3f, 0.3f, stains);
  return a * (1 - 0.55f * crack);
}

float wallpaper(const Texture& t, float x, float y) {
  const float large = scattered_motifs(x, y, 0.31f, 0.55f, t.seed);
  const float small = scattered_motifs(x, y, 0.083f, 0.5f, t.seed + 1);
  const float age = fractal_noise(0.9f * x, 0.9f * y, t.seed + 2, 5);
  const float stripe = unit(floor_int(x / 0.17f), 0, t.seed + 3) - 0.5f;
  const float pattern = std::abs(large) > 0.01f ? 0.5f * large + 0.2f * small : 0.45f * small;
  return t.shade * (1 + 0.14f * stripe + 0.16f * age) * (1 + pattern) + 0.03f * speckle(x, y, t.seed + 4);
}

float brick(const Texture& t, float x, float y) {
  constexpr float kWidth = 0.25f, kHeight = 0.085f, kJoint = 0.006f;
  const std::int32_t course = floor_int(y / kHeight);
  const Cell c =
      cell_at(x + 0.5f * kWidth * static_cast<float>(course & 1) + 0.02f * unit(course, 3, t.seed), y, kWidth, kHeight);
  const Seed cell_seed = hash(c.column, c.row, t.seed);
  const float wear = 0.006f * value_noise(30 * x, 30 * y, t.seed + 1);
  const float edge = std::min(std::min(c.x, kWidth - c.x), std::min(c.y, kHeight - c.y)) + wear;
  const float body = smooth_step(kJoint, kJoint + 0.005f, edge);
  const float grain = fractal_noise(18 * x, 18 * y, t.seed + 2, 4, 0.7f);
  const float tint = mix(0.55f, 1.4f, unit(hash(1, 1, cell_seed)));
  const float chips = scattered_motifs(x, y, 0.055f, 0.25f, t.seed + 3);
  const float face = t.shade * tint * (1 + 0.3f * grain + 0.45f * chips);
  return mix(t.shade * 1.25f * (1 + 0.2f * grain), face, body);
}

float tile(const Texture& t, float x, float y) {
  constexpr float kSize = 0.21f, kJoint = 0.004f;
  const Cell c = cell_at(x, y, kSize, kSize);
  const Seed cell_seed = hash(c.column, c.row, t.seed);
  const float edge = std::min(std::min(c.x, kSize - c.x), std::min(c.y, kSize - c.y));
  const float veins = fractal_noise(7 * x + 3 * unit(cell_seed), 7 * y, cell_seed & 0xffffu, 4, 0.65f);
  float a = t.shade * mix(0.7f, 1.3f, unit(hash(1, 2, cell_seed))) * (1 + 0.22f * veins);
  if (hash(2, 2, cell_seed) % 5 < 2) {
    const float figure =
        motif(c.x - 0.5f * kSize, c.y - 0.5f * kSize, mix(0.04f, 0.09f, unit(hash(3, 2, cell_seed))), cell_seed);
    a *= 1 + figure * (hash(4, 2, cell_seed) & 1u ? 0.6f : -0.6f);
  }
  a *= 1 + 0.5f * scattered_motifs(x, y, 0.06f, 0.22f, t.seed + 5);
  return mix(0.45f * t.shade, a, smooth_step(0.0f, 0.004f, edge - kJoint)) + 0.02f * speckle(x, y, t.seed + 4);
}

// Wood grain along x for a board with seed `cell_seed`.
float grain(float x, float y, Seed cell_seed) {
  const float waviness = 0.02f * value_noise(2.0f * x, 9 * y, cell_seed);
  const float lines = fractal_noise(3.5f * x, 75 * (y + waviness), cell_seed + 1, 3, 0.7f);
  return lines;
}

float knots(float x, float y, Seed seed) {
  const Cell c = cell_at(x, y, 0.24f, 0.13f);
  const Seed cell_seed = hash(c.column, c.row, seed);
  if (cell_seed % 3 != 0) return 0;
  const float dx = (c.x - mix(0.05f, 0.19f, unit(hash(1, 3, cell_seed)))) * 0.6f;
  const float dy = c.y - mix(0.03f, 0.10f, unit(hash(2, 3, cell_seed)));
  const float r = std::sqrt(dx * dx + dy * dy), size = mix(0.006f, 0.018f, unit(hash(3, 3, cell_seed)));
  return smooth_step(size, 0.6f * size, r) * 0.8f + 0.3f * smooth_step(2.2f * size, size, r);
}

float planks(const Texture& t, float x, float y) {
  constexpr float kWidth = 0.115f;
  const std::int32_t row = floor_int(y / kWidth);
  const float length = mix(0.5f, 1.3f, unit(row, 1, t.seed));
  const Cell c = cell_at(x + 3 * unit(row, 2, t.seed), y, length, kWidth);
  const Seed cell_seed = hash(c.column, c.row, t.seed + 9);
  const float edge = std::min(std::min(c.x, length - c.x), std::min(c.y, kWidth - c.y));
  const float body = smooth_step(0.001f, 0.004f, edge);
  const float tint = mix(0.6f, 1.35f, unit(hash(1, 4, cell_seed)));
  const float scuffs = scattered_motifs(x, y, 0.11f, 0.25f, t.seed + 3);
  float a =
      t.shade * tint * (1 + 0.28f * grain(x, y, cell_seed)) * (1 - 0.7f * knots(x + 7 * unit(cell_seed), y, cell_seed));
  a *= 1 + 0.30f * scuffs + 0.12f * fractal_noise(2 * x, 2 * y, t.seed + 2, 3);
  return mix(0.25f * t.shade, a, body);
}

float wood(const Texture& t, float x, float y) {
  const float marks = scattered_motifs(x, y, 0.12f, 0.28f, t.seed + 5);
  const float a = t.shade * (1 + 0.32f * grain(x, y, t.seed)) * (1 - 0.65f * knots(x, y, t.seed + 1));
  return a * (1 + 0.4f * marks) + 0.02f * speckle(x, y, t.seed + 2);
}

float carpet(const Texture& t, float x, float y) {
  const float warp = 0.05f * fractal_noise(1.5f * x, 1.5f * y, t.seed, 2);
  const float large = scattered_motifs(x + warp, y - warp, 0.42f, 0.75f, t.seed + 1);
  const float small = scattered_motifs(x, y, 0.12f, 0.6f, t.seed + 2);
  const float pile = fractal_noise(60 * x, 60 * y, t.seed + 3, 2);
  return t.shade * (1 + 0.5f * large + 0.35f * small * (1 - std::abs(large))) * (1 + 0.18f * pile);
}

float ceiling(const Texture& t, float x, float y) {
  constexpr float kSize = 0.6f;
  const Cell c = cell_at(x, y, kSize, kSize);
  const float edge = std::min(std::min(c.x, kSize - c.x), std::min(c.y, kSize - c.y));
  const Seed cell_seed = hash(c.column, c.row, t.seed);
  const float holes = scattered_motifs(x, y, 0.055f, 0.3f, cell_seed);
  const float stains = fractal_noise(1.1f * x, 1.1f * y, t.seed + 1, 5);
  const float a =
      t.shade * mix(0.85f, 1.1f, unit(cell_seed)) * (1 + 0.2f * stains) * (1 + 0.55f * std::min(holes, 0.15f));
  return mix(0.55f * t.shade, a, smooth_step(0.006f, 0.010f, edge)) + 0.03f * speckle(x, y, t.seed + 2);
}

// The content of a picture without its frame; x, y are measured from its lower corner.
float artwork(const Texture& t, float x, float y, float width, float height) {
  const float size = std::min(width, height);
  float a = mix(0.25f, 0.85f, unit(hash(1, 5, t.seed))) * (1 + 0.3f * fractal_noise(4 * x, 4 * y, t.seed, 3));
  for (std::int32_t i = 0; i < 9; ++i) {
    const Seed cell_seed = hash(i, 6, t.seed);
    const float cx = width * unit(hash(1, i, cell_seed)), cy = height * unit(hash(2, i, cell_seed));
    const float covered = motif(x - cx, y - cy, size * mix(0.06f, 0.30f, unit(hash(3, i, cell_seed))), cell_seed);
    a = mix(a, mix(0.04f, 0.95f, unit(hash(4, i, cell_seed))), covered);
  }
  const bool written = y < mix(0.1f, 0.5f, unit(hash(2, 5, t.seed))) * height;
  if (written)
    a = mix(a, a > 0.45f ? 0.05f : 0.9f, glyphs(x, y, mix(0.03f, 0.07f, unit(hash(3, 5, t.seed))), t.seed + 1));
  return a + 0.03f * speckle(x, y, t.seed + 2);
}

float poster(const Texture& t, float x, float y, float width, float height) {
  const float edge = std::min(std::min(x, width - x), std::min(y, height - y));
  if (edge < 0.022f) return (t.seed & 1u ? 0.12f : 0.75f) * (1 + 0.2f * grain(x + y, x - y, t.seed));
  if (edge < 0.045f) return 0.85f + 0.03f * speckle(x, y, t.seed);
  return artwork(t, x, y, width, height);
}

float window(const Texture& t, float x, float y, float width, float height) {
  const float cross = std::min(std::abs(x - 0.5f * width), std::abs(y - 0.6f * height));
  const float edge = std::min(std::min(std::min(x, width - x), std::min(y, height - y)), cross + 0.02f);
  if (edge < 0.045f) return 0.78f * (1 + 0.12f * fractal_noise(9 * x, 30 * y, t.seed, 3));
  const float ridge = height * (0.5f + 0.18f * fractal_noise(1.5f * x, 0.5f, t.seed + 1, 3));
  const float clouds = 0.80f + 0.18f * fractal_noise(2 * x, 4 * y, t.seed + 2, 4);
  if (y > ridge) return clouds;
  const Cell house = cell_at(x, y, 0.19f, 0.14f);
  const Seed cell_seed = hash(house.column, house.row, t.seed + 3);
  const float wall = mix(0.12f, 0.6f, unit(cell_seed)) * (1 + 0.3f * fractal_noise(25 * x, 25 * y, t.seed + 4, 3));
  return wall * (1 + 0.8f * scattered_motifs(x, y, 0.05f, 0.6f, t.seed + 5));
}

float book(const Texture& t, float x, float y, float height) {
  const bool band = unit(floor_int(y / 0.021f), 0, t.seed) > 0.82f;
  float a = band ? (t.shade > 0.4f ? 0.15f : 0.8f) : t.shade;
  if (y > 0.2f * height && y < 0.85f * height) {
    a = mix(a, t.shade > 0.4f ? 0.08f : 0.85f, glyphs(y, x, 0.018f, t.seed + 1));
  }
  return a * (1 + 0.12f * fractal_noise(40 * x, 40 * y, t.seed + 2, 2));
}

float cardboard(const Texture& t, float x, float y, float width, float height) {
  const float wave = 0.05f * value_noise(4 * x, 120 * y, t.seed);
  float a = t.shade * (1 + wave + 0.2f * fractal_noise(5 * x, 5 * y, t.seed + 1, 4));
  if (std::abs(x - 0.5f * width) < 0.03f) a *= 1.35f + 0.1f * value_noise(50 * x, 8 * y, t.seed + 2);
  const float lx = x - width * mix(0.08f, 0.3f, unit(t.seed)),
              ly = y - height * mix(0.15f, 0.4f, unit(hash(1, 7, t.seed)));
  if (lx > 0 && ly > 0 && lx < 0.38f * width && ly < 0.35f * height)
    a = mix(0.88f, 0.06f, glyphs(lx, ly, 0.022f, t.seed + 3));
  a *= 1 + 0.6f * scattered_motifs(x, y, 0.10f, 0.3f, t.seed + 4);
  return a;
}

float fabric(const Texture& t, float x, float y) {
  const float warp = 0.012f * fractal_noise(5 * x, 5 * y, t.seed, 2);
  const float across = unit(floor_int((x + warp) / 0.045f), 1, t.seed),
              along = unit(floor_int((y + warp) / 0.045f), 2, t.seed);
  const float folds = fractal_noise(5 * x, 1.2f * y, t.seed + 1, 3);
  return t.shade * (0.55f + 0.5f * across + 0.5f * along) *
         (1 + 0.25f * folds + 0.15f * fractal_noise(70 * x, 70 * y, t.seed + 2, 2)) *
         (1 + 0.5f * scattered_motifs(x, y, 0.09f, 0.35f, t.seed + 3));
}

float leaves(const Texture& t, float x, float y) {
  const float large = scattered_motifs(x, y, 0.13f, 0.8f, t.seed),
              small = scattered_motifs(x, y, 0.047f, 0.8f, t.seed + 1);
  const float clumps = fractal_noise(2.1f * x, 2.1f * y, t.seed + 2, 5, 0.65f);
  return t.shade * (1 + 0.55f * large) * (1 + 0.45f * small) * (1 + 0.5f * clumps) + 0.03f * speckle(x, y, t.seed + 3);
}

// Clouds of tens of metres.
float clouds(const Texture& t, float x, float y) {
  const float cover = fractal_noise(x / 30, y / 30, t.seed, 6, 0.55f);
  return t.shade * mix(0.80f, 1.15f, smooth_step(-0.35f, 0.35f, cover));
}

// `y` is the height above the lower edge.
float horizon(const Texture& t, float x, float y) {
  const float ridge =
      9 + 5 * fractal_noise(x / 35, 0.5f, t.seed, 3) + 0.8f * fractal_noise(x / 1.5f, 1.5f, t.seed + 1, 3);
  if (y > ridge) return clouds({t.material, t.seed + 2, 0.8f}, x, 1.6f * y);
  const float haze = 0.16f * y / ridge, woods = fractal_noise(x / 2, y / 2, t.seed + 3, 5, 0.7f);
  const Cell house = cell_at(x, y, 7.0f, 4.0f);
  const Seed cell_seed = hash(house.column, house.row, t.seed + 4);
  const float wall = inside(box_distance(house.x - 3.5f, house.y - 2.0f, 1.6f, 1.1f));
  const float built = unit(cell_seed) < 0.3f ? wall : 0.0f;
  return mix(0.16f * (1 + 0.5f * woods), mix(0.3f, 0.7f, unit(hash(1, 8, cell_seed))), built) + haze;
}

float asphalt(const Texture& t, float x, float y) {
  const float stains = fractal_noise(0.33f * x, 0.33f * y, t.seed, 5, 0.7f);
  const float stones = fractal_noise(24 * x, 24 * y, t.seed + 1, 2, 0.8f);
  const float crack = smooth_step(0.010f, 0.0f, std::abs(fractal_noise(0.45f * x, 0.45f * y, t.seed + 2, 4)));
  const float spot = scattered_motifs(x, y, 0.6f, 0.2f, t.seed + 3);
  const float a = t.shade * (1 + 0.40f * stains + 0.28f * stones + 0.06f * speckle(x, y, t.seed + 4));
  return a * (1 + 0.22f * spot) * (1 - 0.45f * crack);
}

float paving(const Texture& t, float x, float y) {
  constexpr float kSide = 0.45f, kJoint = 0.012f;
  const std::int32_t row = floor_int(y / kSide);
  const Cell c = cell_at(x + kSide * unit(row, 1, t.seed), y, kSide, kSide);
  const Seed cell_seed = hash(c.column, c.row, t.seed + 1);
  const float edge = std::min(std::min(c.x, kSide - c.x), std::min(c.y, kSide - c.y));
  const float stones = fractal_noise(16 * x, 16 * y, t.seed + 2, 3, 0.7f),
              dirt = fractal_noise(0.7f * x, 0.7f * y, t.seed + 3, 4);
  const float a = t.shade * mix(0.80f, 1.18f, unit(cell_seed)) * (1 + 0.25f * stones + 0.3f * dirt);
  return mix(0.5f * t.shade, a, smooth_step(0.3f * kJoint, kJoint, edge));
}

float pattern(const Texture& t, float x, float y, float width, float height) {
  switch (t.material) {
    case Material::kPlain:
      return t.shade * (1 + 0.12f * fractal_noise(12 * x, 12 * y, t.seed, 4));
    case Material::kPlaster:
      return plaster(t, x, y);
    case Material::kWallpaper:
      return wallpaper(t, x, y);
    case Material::kBrick:
      return brick(t, x, y);
    case Material::kTile:
      return tile(t, x, y);
    case Material::kPlanks:
      return planks(t, x, y);
    case Material::kWood:
      return wood(t, x, y);
    case Material::kCarpet:
      return carpet(t, x, y);
    case Material::kCeiling:
      return ceiling(t, x, y);
    case Material::kPoster:
      return poster(t, x, y, width, height);
    case Material::kWindow:
      return window(t, x, y, width, height);
    case Material::kBook:
      return book(t, x, y, height);
    case Material::kCardboard:
      return cardboard(t, x, y, width, height);
    case Material::kFabric:
      return fabric(t, x, y);
    case Material::kLeaves:
      return leaves(t, x, y);
    case Material::kSky:
      return clouds(t, x, y);
    case Material::kHorizon:
    case Material::kHills:
      return t.material == Material::kHorizon ? horizon(t, x, y) : horizon(t, x / 6, y / 6);
    case Material::kAsphalt:
    case Material::kPaving:
      return t.material == Material::kAsphalt ? asphalt(t, x, y) : paving(t, x, y);
    case Material::kLamp:
      return 0.9f;
  }
  return t.shade;
}

}  // namespace

float albedo(const Texture& texture, float x, float y, float width, float height) {
  return std::clamp(pattern(texture, x, y, width, height), 0.03f, 0.95f);
}

}  // namespace bslam::simulator
