#include <fieldmark/tools/results/sheet.h>

#include <fieldmark/engine/shape_checks.h>
#include <fieldmark/imaging/image.h>

#include <algorithm>

namespace fieldmark::results {
namespace {

constexpr Index kGap = 4;  // pixels

Tensor<float> magnified_difference(const Tensor<float>& a, const Tensor<float>& b, float gain) {
  Tensor<float> difference(a.shape);
  for (Index i = 0; i < a.size(); ++i) difference[i] = std::clamp(0.5f + gain * (b[i] - a[i]), 0.f, 1.f);
  return difference;
}

}  // namespace

Tensor<float> comparison_sheet(std::span<const ImagePair> pairs, float gain) {
  std::vector<Tensor<float>> cells;
  for (const auto& pair : pairs) {
    check_same("comparison_sheet", "first", pair.first.shape, "second", pair.second.shape);
    cells.push_back(quantize8(pair.first));
    cells.push_back(quantize8(pair.second));
    cells.push_back(magnified_difference(cells[cells.size() - 2], cells.back(), gain));
  }
  return tile(cells, 3, kGap);
}

}  // namespace fieldmark::results
