#include "kernels/march.h"

namespace fieldmark::kernels::FIELDMARK_ISA_NS {
namespace {

constexpr int kBatch = 16;  // candidates judged together: the loops over them vectorise

[[gnu::always_inline]] inline float time_of(const MarchRay& r, std::int32_t k) {
  return r.near + (static_cast<float>(k) + r.jitter) * r.step;
}

[[gnu::always_inline]] inline float clamped(float p, float top) {
  const float above = p > 0.f ? p : 0.f;  // and where p is NaN
  return above < top ? above : top;
}

// Whole steps until the ray leaves the empty blocks around its next sample; 0 if that lies in a block with an
// occupied cell.
[[gnu::always_inline]] inline std::int32_t empty_steps(const MarchGrid& g, const MarchRay& r, float t) {
  const auto n = static_cast<float>(g.block_side);
  float p[3], b[3];  // in blocks
  std::int32_t at = 0;
  for (int a = 2; a >= 0; --a) {
    p[a] = (r.o[a] + t * r.d[a]) * n;
    const auto block = static_cast<std::int32_t>(clamped(p[a], n - 0.5f));
    b[a] = static_cast<float>(block);
    at = at * g.block_side + block;
  }
  const std::int32_t clearance = g.clearance[at];
  if (clearance == 0) return 0;
  // Faces of the empty cube lie at b - clearance + 1 and b + clearance.
  const float half = static_cast<float>(clearance) - 0.5f, side = 1 / n;
  float leave = 1e9f;
  for (int a = 0; a < 3; ++a) {
    const float away = (b[a] + 0.5f - p[a]) * r.steps[a] + half * __builtin_fabsf(r.steps[a]);
    leave = away < leave ? away : leave;
  }
  const auto steps = static_cast<std::int32_t>(__builtin_ceilf(leave * side));
  return steps > 1 ? steps : 1;
}

// Which of the next candidates are samples.
[[gnu::always_inline]] inline void judge(const MarchGrid& g, const MarchRay& r, float* t, std::int32_t* hit) {
  const auto n = static_cast<float>(g.resolution);
  std::int32_t c[3][kBatch];
  for (int i = 0; i < kBatch; ++i) t[i] = time_of(r, r.k + i);
  for (int a = 0; a < 3; ++a)
    for (int i = 0; i < kBatch; ++i) {
      c[a][i] = static_cast<std::int32_t>(clamped((r.o[a] + t[i] * r.d[a]) * n, n - 0.5f));
    }
  for (int i = 0; i < kBatch; ++i) {
    const std::int32_t x = c[0][i], y = c[1][i], z = c[2][i];
    const std::int32_t coarse = (x >> 3) + g.coarse_side * ((y >> 3) + g.coarse_side * (z >> 3));
    const std::int32_t block = (x >> 2 & 1) + 2 * (y >> 2 & 1) + 4 * (z >> 2 & 1);
    const std::int32_t half = z >> 1 & 1, bit = (x & 3) + 4 * (y & 3) + 16 * (z & 1);
    const auto word = static_cast<std::int32_t>(g.words[16 * coarse + 2 * block + half]);
    hit[i] = t[i] < r.far ? (word >> bit) & 1 : 0;
  }
}

}  // namespace

// As empty_steps(), for all lanes at a time: one ray alone waits for each number in turn, and most rays of a
// picture do nothing but jump.
void march_to_blocks(const MarchGrid& g, MarchRays& rays) {
  MarchRays r = rays;
  const auto n = static_cast<float>(g.block_side);
  const float side = 1 / n;
  for (std::int32_t going = 1; going;) {
    float t[kMarchLanes], away[3][kMarchLanes], clear[kMarchLanes];
    std::int32_t at[kMarchLanes] = {};
    for (int i = 0; i < kMarchLanes; ++i)
      t[i] = r.near[i] + (static_cast<float>(r.k[i]) + r.jitter[i]) * r.step[i];
    for (int a = 2; a >= 0; --a)
      for (int i = 0; i < kMarchLanes; ++i) {
        const float p = (r.o[a][i] + t[i] * r.d[a][i]) * n;
        const auto block = static_cast<std::int32_t>(clamped(p, n - 0.5f));
        away[a][i] = (static_cast<float>(block) + 0.5f - p) * r.steps[a][i];
        at[i] = at[i] * g.block_side + block;
      }
    for (int i = 0; i < kMarchLanes; ++i) clear[i] = g.clearance[at[i]];
    going = 0;
    for (int i = 0; i < kMarchLanes; ++i) {
      float leave = 1e9f;
      for (int a = 0; a < 3; ++a) {
        const float face = away[a][i] + (clear[i] - 0.5f) * __builtin_fabsf(r.steps[a][i]);
        leave = face < leave ? face : leave;
      }
      const auto whole = static_cast<std::int32_t>(__builtin_ceilf(leave * side));
      const std::int32_t jump = whole > 1 ? whole : 1, goes = (t[i] < r.far[i]) & (clear[i] > 0);
      r.k[i] += goes ? jump : 0;
      going |= goes;
    }
  }
  rays = r;
}

std::int64_t march(const MarchGrid& grid, MarchRay& r, std::int64_t max, float* out) {
  std::int64_t count = 0;
  while (count < max) {
    const float t = time_of(r, r.k);
    if (!(t < r.far)) break;
    if (const std::int32_t steps = empty_steps(grid, r, t)) {
      r.k += steps;
      continue;
    }
    float candidates[kBatch];
    std::int32_t hit[kBatch];
    judge(grid, r, candidates, hit);
    std::uint32_t left = 0;
    for (int i = 0; i < kBatch; ++i) left |= static_cast<std::uint32_t>(hit[i]) << i;
    std::int32_t passed = kBatch;
    while (left) {
      const int i = __builtin_ctz(left);
      left &= left - 1;
      out[count++] = candidates[i];
      if (count < max) continue;
      passed = i + 1;
      break;
    }
    r.k += passed;
  }
  return count;
}

}  // namespace fieldmark::kernels::FIELDMARK_ISA_NS
