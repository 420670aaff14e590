#include "carriers.h"
#include <fieldmark/core/error.h>

#include <algorithm>
#include <array>

#include "ordered_sum.h"

namespace fieldmark::watermark {
namespace {

constexpr Index kBlock = 4096, kLanes = 16;  // samples; lanes, each with a tape of its own

// Returns the entry of a cell for the last pixel, and adds it if it is missing.
std::size_t entry_of(Carriers& c, std::int32_t cell) {
  const auto entry = std::find(c.cell.begin() + c.begin.back(), c.cell.end(), cell);
  const auto number = static_cast<std::size_t>(entry - c.cell.begin());
  if (entry == c.cell.end()) {
    c.cell.push_back(cell);
    c.part.insert(c.part.end(), 3, 0.f);
  }
  return number;
}

// Computes y = slope x, in place.
void times(const std::array<std::array<double, 3>, 3>& slope, float* x) {
  const double from[] = {static_cast<double>(x[0]), static_cast<double>(x[1]), static_cast<double>(x[2])};
  for (std::size_t c = 0; c < 3; ++c)
    x[c] = static_cast<float>(slope[c][0] * from[0] + slope[c][1] * from[1] + slope[c][2] * from[2]);
}

// Returns [S, 3] for all samples, by blocks, so that the network's buffers stay in cache.
std::vector<float> carrier_of(const Owner& owner, const CachedView& v) {
  const auto n = static_cast<Index>(v.weight.size());
  std::vector<float> out(at(3 * n));
  parallel_for(kLanes, 1, [&](Index lane, Index) {
    Tape<float> tape;
    for (Index begin = lane * kBlock; begin < n; begin += kLanes * kBlock) {
      const Index count = std::min(kBlock, n - begin);
      tape.reset();
      const Var<float> carrier = owner.mark().carrier(Params<float>(owner.params, nullptr),
                                                      tape.constant(&v.position[at(3 * begin)], {count, 3}),
                                                      tape.constant(&v.colour[at(3 * begin)], {count, 3}));
      std::copy_n(carrier.value(), 3 * count, out.begin() + 3 * begin);
    }
  });
  return out;
}

// Computes the carriers of the pixels first .. last - 1.
Carriers carriers_of_pixels(const Owner& owner, const CachedView& v, const std::vector<float>& carrier,
                            Index first, Index last) {
  Carriers out{Tensor<float>({last - first, 1, 3}), {0}, {}, {}};
  const auto gain = static_cast<float>(owner.gain);
  for (Index p = first; p < last; ++p) {
    for (std::int32_t k = v.sample_begin[at(p)]; k < v.sample_begin[at(p + 1)]; ++k) {
      float seen[3];
      for (std::size_t a = 0; a < 3; ++a) {
        const float c = v.colour[3 * at(k) + a], add = gain * carrier[3 * at(k) + a];
        seen[a] = v.weight[at(k)] * 0.5f * (std::clamp(c + add, 0.f, 1.f) - std::clamp(c - add, 0.f, 1.f));
      }
      const CellGrid::Mix mix = owner.cells.mix(&v.position[3 * at(k)]);
      for (std::size_t m = 0; m < at(mix.count); ++m) {
        if (mix.part[m] == 0) continue;
        const std::size_t entry = entry_of(out, mix.cell[m]);
        for (std::size_t a = 0; a < 3; ++a) out.part[3 * entry + a] += mix.part[m] * seen[a];
      }
      for (std::size_t a = 0; a < 3; ++a) out.whole[3 * (p - first) + static_cast<Index>(a)] += seen[a];
    }
    out.begin.push_back(static_cast<std::int32_t>(out.cell.size()));
  }
  return out;
}

}  // namespace

Carriers carriers(const Owner& owner, const CachedView& v) {
  const std::vector<float> carrier = carrier_of(owner, v);
  const Index pixels = v.height * v.width;
  std::vector<Carriers> chunks(at((pixels + kPixelChunk - 1) / kPixelChunk));
  parallel_for(pixels, kPixelChunk, [&](Index first, Index last) {
    chunks[at(first / kPixelChunk)] = carriers_of_pixels(owner, v, carrier, first, last);
  });
  Carriers out{Tensor<float>({v.height, v.width, 3}), {0}, {}, {}};
  auto next = out.whole.data.begin();
  for (const Carriers& chunk : chunks) {
    const std::int32_t offset = out.begin.back();
    for (std::size_t p = 1; p < chunk.begin.size(); ++p) out.begin.push_back(offset + chunk.begin[p]);
    out.cell.insert(out.cell.end(), chunk.cell.begin(), chunk.cell.end());
    out.part.insert(out.part.end(), chunk.part.begin(), chunk.part.end());
    next = std::ranges::copy(chunk.whole.data, next).out;
  }
  return out;
}

void change_colours(Carriers& mark, const Tensor<float>& base, const ToneFit& tones) {
  parallel_for(std::ssize(mark.begin) - 1, kPixelChunk, [&](Index first, Index last) {
    for (auto p = at(first); p < at(last); ++p) {
      if (mark.begin[p] == mark.begin[p + 1]) continue;
      const auto slope = tones.slope(&base.data[3 * p]);
      times(slope, &mark.whole.data[3 * p]);
      for (std::int32_t e = mark.begin[p]; e < mark.begin[p + 1]; ++e) times(slope, &mark.part[3 * at(e)]);
    }
  });
}

}  // namespace fieldmark::watermark
