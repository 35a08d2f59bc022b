#include "camera/view_overlap.h"

#include <algorithm>
#include <array>

namespace bslam::camera {
namespace {

constexpr std::array kDistances = {0.5, 2.0, 10.0, 100.0};  // metres

// Of a coordinate, in pixels, of an image of `size` pixels.
std::size_t cell_of(double coordinate, double size, std::size_t cells) {
  const double cell = (coordinate + 0.5) / size * static_cast<double>(cells);
  return static_cast<std::size_t>(std::clamp(cell, 0.0, static_cast<double>(cells - 1)));
}

}  // namespace

UsedView UsedView::all_of(const Camera& camera) {
  UsedView view(camera);
  view.used_.set();
  return view;
}

std::size_t UsedView::column_of(const Vector2d& pixel) const { return cell_of(pixel.x(), width_, kColumns); }

std::size_t UsedView::row_of(const Vector2d& pixel) const { return cell_of(pixel.y(), height_, kRows); }

void UsedView::add(const Vector2d& pixel) {
  const std::size_t column = column_of(pixel), row = row_of(pixel);
  for (std::size_t r = row - (row > 0); r <= std::min(row + 1, kRows - 1); ++r) {
    for (std::size_t c = column - (column > 0); c <= std::min(column + 1, kColumns - 1); ++c)
      used_.set(r * kColumns + c);
  }
}

Vector2d UsedView::centre(std::size_t column, std::size_t row) const {
  return {(static_cast<double>(column) + 0.5) * width_ / static_cast<double>(kColumns) - 0.5,
          (static_cast<double>(row) + 0.5) * height_ / static_cast<double>(kRows) - 0.5};
}

SampledView::SampledView(const Camera& of, const UsedView& used_by_it) : camera(&of), used(used_by_it) {
  for (std::size_t row = 0; row < UsedView::kRows; ++row) {
    for (std::size_t column = 0; column < UsedView::kColumns; ++column) {
      if (!used.contains(column, row)) continue;
      if (const auto bearing = camera->unproject(used.centre(column, row))) bearings.push_back(*bearing);
    }
  }
}

double overlap_share(const SampledView& a, const SampledView& b, const geometry::SE3& T_b_a) {
  if (a.used.size() == 0) return 0.0;
  double share = 0.0;
  for (const double distance : kDistances) {
    const auto seen = std::ranges::count_if(a.bearings, [&](const Vector3d& bearing) {
      const auto pixel = b.camera->project(T_b_a * (distance * bearing));
      return pixel && b.camera->contains(*pixel) && b.used.contains(*pixel);
    });
    share = std::max(share, static_cast<double>(seen) / static_cast<double>(a.used.size()));
  }
  return share;
}

}  // namespace bslam::camera
