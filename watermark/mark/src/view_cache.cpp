#include <fieldmark/core/error.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/watermark/mark/cell_grid.h>
#include <fieldmark/watermark/mark/view_cache.h>

#include <algorithm>
#include <array>

namespace fieldmark::watermark {
namespace {

constexpr float kLeastOpacity = 0.02f;  // a ray with less is background
constexpr Index kRows = 8;              // of pixels that one thread collects at a time
constexpr Index kRays = 32;             // traced at a time: the samples of a whole row leave the cache
constexpr float kPart = 1.f / 128;      // cube sides, half of the finest cell: samples so close form one part

// Calls trace(lane, pixel, rays) for some neighbours in a row of pixels at a time, from `pixel` on, until it
// has covered all rows, and writes directions [P, 3].
template <class F>
void for_rays(const nerf::RadianceField& field, const nerf::Camera& camera, std::vector<float>& direction,
              F trace) {
  const Index w = camera.width;
  parallel_for(nerf::Renderer::kLanes, 1, [&](Index lane, Index) {
    std::vector<float> places;
    nerf::CubeRays rays;
    for (Index y = lane; y < camera.height; y += nerf::Renderer::kLanes)
      for (Index left = 0; left < w; left += kRays) {
        const Index right = std::min(left + kRays, w), pixel = y * w + left;
        places.clear();
        for (Index x = left; x < right; ++x)
          places.insert(places.end(), {static_cast<float>(x), static_cast<float>(y)});
        rays.resize(right - left);
        rays.set(field.space, 0, camera, places);
        std::ranges::copy(rays.seen_from, direction.begin() + 3 * pixel);
        trace(lane, pixel, rays);
      }
  });
}

// Joins neighbouring samples of a ray: samples from `from` on, near to far, become parts of at most kPart
// along the ray, each at the weighted mean place and colour of its samples. Returns the end of the parts.
std::vector<nerf::SeenSample>::iterator join_parts(std::vector<nerf::SeenSample>::iterator from,
                                                   std::vector<nerf::SeenSample>::iterator to) {
  auto part = from;
  std::array<float, 3> start = from->position;
  for (auto s = from + 1; s != to; ++s) {
    float square = 0;
    for (std::size_t a = 0; a < 3; ++a) square += (s->position[a] - start[a]) * (s->position[a] - start[a]);
    if (square > kPart * kPart) {
      start = s->position;
      *++part = *s;
      continue;
    }
    const float share = s->weight / (part->weight + s->weight);
    for (std::size_t a = 0; a < 3; ++a) {
      part->position[a] += share * (s->position[a] - part->position[a]);
      part->colour[a] += share * (s->colour[a] - part->colour[a]);
    }
    part->weight += s->weight;
  }
  return part + 1;
}

// Keeps the heaviest parts of each ray, heaviest first. Writes rgba [rays, 4], the image without the
// background.
void keep_heaviest(std::vector<nerf::SeenSample>& seen, Index parts, float* rgba) {
  auto end = seen.begin();
  for (auto from = seen.begin(); from != seen.end();) {
    const Index ray = from->ray;
    const auto to = std::find_if(from, seen.end(), [&](const auto& s) { return s.ray != ray; });
    float* c = rgba + 4 * ray;
    for (auto s = from; s != to; ++s) {
      for (std::size_t a = 0; a < 3; ++a) c[a] += s->weight * s->colour[a];
      c[3] += s->weight;
    }
    const auto joined = join_parts(from, to);
    std::stable_sort(from, joined, [](const auto& a, const auto& b) { return a.weight > b.weight; });
    const auto kept = std::min<std::ptrdiff_t>(parts, joined - from);
    float sum = 0;
    for (auto s = from; s != from + kept; ++s) sum += s->weight;
    for (auto s = from; s != from + kept; ++s, ++end) {
      *end = *s;
      end->weight *= std::min(c[3], 1.f) / sum;
    }
    from = to;
  }
  seen.erase(end, seen.end());
}

// All pixels: rgba [P, 4], direction [P, 3] and, row by row, the samples.
struct Traced {
  std::vector<float> rgba, direction;
  std::vector<std::vector<nerf::SeenSample>> rows;
};

Traced trace_all(nerf::Renderer& renderer, const nerf::RadianceField& field, const nerf::Camera& camera,
                 Index samples) {
  const Index w = camera.width, pixels = camera.height * w;
  Traced t{std::vector<float>(at(4 * pixels)), std::vector<float>(at(3 * pixels)), {}};
  t.rows.resize(at(camera.height));
  for_rays(field, camera, t.direction, [&](Index lane, Index pixel, const nerf::CubeRays& rays) {
    float* rgba = &t.rgba[at(4 * pixel)];
    auto& row = t.rows[at(pixel / w)];
    const Index left = pixel % w;
    if (samples > 1) {
      std::vector<nerf::SeenSample> seen;
      renderer.trace_samples(rays.batch(field.space), lane, seen);
      keep_heaviest(seen, samples, rgba);
      for (nerf::SeenSample& s : seen) s.ray += left;
      row.insert(row.end(), seen.begin(), seen.end());
      return;
    }
    const auto n = std::ssize(rays.seen_from) / 3;
    std::vector<float> position(at(3 * n));
    renderer.trace(rays.batch(field.space), lane, rgba, position.data());
    for (Index i = 0; i < n; ++i) {
      const float *c = rgba + 4 * i, *x = &position[at(3 * i)];
      if (c[3] > 0)
        row.push_back({.ray = left + i,
                       .weight = std::min(c[3], 1.f),
                       .position = {x[0], x[1], x[2]},
                       .colour = {c[0] / c[3], c[1] / c[3], c[2] / c[3]}});
    }
  });
  return t;
}

// Writes the pixels of row y, and forgets the samples of its background.
void finish_row(Traced& t, Index y, float background, CachedView& view) {
  const Index w = view.width;
  for (Index p = y * w; p < (y + 1) * w; ++p) {
    const float* c = &t.rgba[at(4 * p)];
    for (Index a = 0; a < 3; ++a) view.base[3 * p + a] = std::clamp(c[a] + (1 - c[3]) * background, 0.f, 1.f);
    view.opacity[p] = std::min(c[3], 1.f);
  }
  std::erase_if(t.rows[at(y)],
                [&](const auto& s) { return t.rgba[at(4 * (y * w + s.ray) + 3)] < kLeastOpacity; });
}

// Writes the samples of row y from `begin` on.
void put_samples(const Traced& t, Index y, std::size_t begin, CachedView& view) {
  const auto& row = t.rows[at(y)];
  auto next = row.begin();
  for (Index x = 0; x < view.width; ++x) {
    const Index p = y * view.width + x;
    for (; next != row.end() && next->ray == x; ++next) {
      const std::size_t k = begin + static_cast<std::size_t>(next - row.begin());
      for (std::size_t a = 0; a < 3; ++a) {
        view.position[3 * k + a] = next->position[a];
        view.direction[3 * k + a] = t.direction[at(3 * p) + a];
        view.colour[3 * k + a] = std::clamp(next->colour[a], 0.f, 1.f);
      }
      view.weight[k] = next->weight;
    }
    view.sample_begin[at(p + 1)] =
        static_cast<std::int32_t>(begin + static_cast<std::size_t>(next - row.begin()));
  }
}

}  // namespace

CachedView cache_view(nerf::Renderer& renderer, const nerf::RadianceField& field, const nerf::Camera& camera,
                      Index samples) {
  if (samples < 1)
    throw ValueError("[cache_view] samples must be at least 1, got " + std::to_string(samples));
  const Index h = camera.height, w = camera.width;
  Traced traced = trace_all(renderer, field, camera, samples);
  const float background = nerf::background_value(field.background);
  CachedView view{h, w, Tensor<float>({h, w, 3}), Tensor<float>({h, w}), {}, {}, {}, {}, {}};
  parallel_for(h, kRows, [&](Index begin, Index end) {
    for (Index y = begin; y < end; ++y) finish_row(traced, y, background, view);
  });
  std::vector<std::size_t> row_begin{0};
  for (const auto& row : traced.rows) row_begin.push_back(row_begin.back() + row.size());
  view.sample_begin.resize(at(h * w + 1));
  view.weight.resize(row_begin.back());
  for (auto* vectors : {&view.position, &view.direction, &view.colour}) vectors->resize(3 * row_begin.back());
  parallel_for(h, kRows, [&](Index begin, Index end) {
    for (Index y = begin; y < end; ++y) put_samples(traced, y, row_begin[at(y)], view);
  });
  view.camera = camera;
  return view;
}

std::vector<float> foreground_mask(const CachedView& v) {
  std::vector<float> mask(at(v.height * v.width), 0.f);
  for (Index p = 0; p < v.height * v.width; ++p)
    if (v.opacity[p] > 0.5f && v.sample_begin[at(p)] != v.sample_begin[at(p + 1)]) mask[at(p)] = 1;
  return mask;
}

std::vector<double> visible_area(std::span<const CachedView> views, Index side) {
  std::vector<double> area(static_cast<std::size_t>(side * side * side));
  for (const CachedView& view : views)
    for (std::size_t k = 0; k < view.weight.size(); ++k)
      area[static_cast<std::size_t>(CellGrid::place(side, &view.position[3 * k]))] +=
          static_cast<double>(view.weight[k]);
  return area;
}

}  // namespace fieldmark::watermark
