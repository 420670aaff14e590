#include <fieldmark/core/error.h>
#include <fieldmark/nerf/importance_points.h>

#include <algorithm>

namespace fieldmark::nerf {
namespace {
constexpr double kFloor = 3e-4;
}

template <class T>
void importance_points(std::span<const T> edge, std::span<const T> weight, std::span<const T> u,
                       std::span<T> out) {
  if (weight.empty() || edge.size() != weight.size() + 1)
    throw ShapeError(
        "[importance_points] edge must have one number more than weight, which has at least 1, got " +
        std::to_string(edge.size()) + " and " + std::to_string(weight.size()));
  if (out.size() != u.size())
    throw ShapeError("[importance_points] out must have the " + std::to_string(u.size()) +
                     " numbers of u, got " + std::to_string(out.size()));
  const std::size_t n = weight.size();
  const double length = static_cast<double>(edge[n]) - static_cast<double>(edge[0]);
  const double per_length = length > 0 ? kFloor / length : 0;
  const auto mass = [&](std::size_t i) {
    return static_cast<double>(weight[i]) +
           per_length * (static_cast<double>(edge[i + 1]) - static_cast<double>(edge[i]));
  };
  double total = 0;
  for (std::size_t i = 0; i < n; ++i) total += mass(i);

  // Sums in double: what is left within an interval is a difference of them.
  std::size_t i = 0;
  double before = 0, here = mass(0);
  for (std::size_t j = 0; j < u.size(); ++j) {
    const double want = static_cast<double>(u[j]) * total;
    while (i + 1 < n && before + here < want) {
      before += here;
      here = mass(++i);
    }
    const double lower = static_cast<double>(edge[i]), upper = static_cast<double>(edge[i + 1]);
    const double part = here > 0 ? std::clamp((want - before) / here, 0.0, 1.0) : 0;
    out[j] = static_cast<T>(lower + part * (upper - lower));
  }
}

template void importance_points(std::span<const float>, std::span<const float>, std::span<const float>,
                                std::span<float>);
template void importance_points(std::span<const double>, std::span<const double>, std::span<const double>,
                                std::span<double>);

}  // namespace fieldmark::nerf
