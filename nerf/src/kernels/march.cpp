#include "kernels/march.h"

namespace fieldmark::kernels::FIELDMARK_ISA_NS {
namespace {

constexpr int kBatch = 16;  // candidates judged together, so that loops over them vectorise
constexpr int kFew = 8;     // the same in a contracted space, where each depends on the one before

[[gnu::always_inline]] inline float time_of(const MarchRay& r, std::int32_t k) {
  return r.near + (static_cast<float>(k) + r.jitter) * r.step;
}

[[gnu::always_inline]] inline float clamped(float p, float top) {
  const float above = p > 0.f ? p : 0.f;  // also for NaN
  return above < top ? above : top;
}

// Returns the number of whole steps until the ray leaves the empty blocks around its next sample; 0 if that
// sample lies in a block with an occupied cell.
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

// Returns 1 if the cell at integer coordinates is occupied.
[[gnu::always_inline]] inline std::int32_t occupied(const MarchGrid& g, std::int32_t x, std::int32_t y,
                                                    std::int32_t z) {
  const std::int32_t coarse = (x >> 3) + g.coarse_side * ((y >> 3) + g.coarse_side * (z >> 3));
  const std::int32_t block = (x >> 2 & 1) + 2 * (y >> 2 & 1) + 4 * (z >> 2 & 1);
  const std::int32_t half = z >> 1 & 1, bit = (x & 3) + 4 * (y & 3) + 16 * (z & 1);
  const auto word = static_cast<std::int32_t>(g.words[16 * coarse + 2 * block + half]);
  return (word >> bit) & 1;
}

// Decides which of the next candidates are samples.
[[gnu::always_inline]] inline void judge(const MarchGrid& g, const MarchRay& r, float* t, std::int32_t* hit) {
  const auto n = static_cast<float>(g.resolution);
  std::int32_t c[3][kBatch];
  for (int i = 0; i < kBatch; ++i) t[i] = time_of(r, r.k + i);
  for (int a = 0; a < 3; ++a)
    for (int i = 0; i < kBatch; ++i) {
      c[a][i] = static_cast<std::int32_t>(clamped((r.o[a] + t[i] * r.d[a]) * n, n - 0.5f));
    }
  for (int i = 0; i < kBatch; ++i) {
    const std::int32_t seen = occupied(g, c[0][i], c[1][i], c[2][i]);
    hit[i] = t[i] < r.far ? seen : 0;
  }
}

// Returns the largest coordinate of a point in inner half sides from the centre, at least 1: the factor by
// which samples are farther apart there. Clamped to kMarchFarthest, also returned for NaN.
[[gnu::always_inline]] inline float scale_at(float x, float y, float z) {
  const float a = 4 * __builtin_fabsf(x - 0.5f), b = 4 * __builtin_fabsf(y - 0.5f),
              c = 4 * __builtin_fabsf(z - 0.5f);
  const float larger = a > b ? a : b, largest = larger > c ? larger : c, s = largest > 1.f ? largest : 1.f;
  const bool in = (a < kMarchFarthest) & (b < kMarchFarthest) & (c < kMarchFarthest);
  return in ? s : kMarchFarthest;
}

[[gnu::always_inline]] inline float scale_at(const MarchRay& r, float t) {
  return scale_at(r.o[0] + t * r.d[0], r.o[1] + t * r.d[1], r.o[2] + t * r.d[2]);
}

// Returns the factor by which a point at scale s moves towards the centre, see contract().
[[gnu::always_inline]] inline float contraction(float s) { return s > 1.f ? (2 - 1 / s) / s : 1.f; }

// Returns how many samples certainly stay in the empty blocks around one at scale s. A step moves the image
// by at most `step` where space is not contracted, and by less than 4 steps elsewhere. With |dy| = s step for
// the largest coordinate and c = (2/s - 1/s^2) y, |dc| <= (2/s - 1/s^2) |dy| + s (2/s^2 - 2/s^3) |dy| = (4 -
// 3/s) step.
[[gnu::always_inline]] inline std::int32_t contracted_steps(float clearance, float side, float s,
                                                            float step) {
  const float clear = side * (clearance - 1);
  const auto whole = static_cast<std::int32_t>(clear / (s + 4 * clear < 1.f ? step : 4 * step));
  return whole > 1 ? whole : 1;
}

// As empty_steps() for a contracted ray: 0 if the next sample lies in a block with an occupied cell, or past
// the end.
[[gnu::always_inline]] inline std::int32_t empty_contracted_steps(const MarchGrid& g, const MarchRay& r) {
  const auto n = static_cast<float>(g.block_side);
  const float s = scale_at(r, r.near);
  std::int32_t at = 0;
  for (int a = 2; a >= 0; --a) {
    const float c = 0.5f + contraction(s) * ((r.o[a] + r.near * r.d[a]) - 0.5f);
    at = at * g.block_side + static_cast<std::int32_t>(clamped(c * n, n - 0.5f));
  }
  const std::int32_t clearance = g.clearance[at];
  if (clearance == 0 || !(s < kMarchFarthest)) return 0;
  return contracted_steps(static_cast<float>(clearance), 1 / n, s, r.step);
}

}  // namespace

// As empty_steps(), for all lanes at once: a single ray waits for each number in turn, and most rays of an
// image only jump.
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

void march_contracted_to_blocks(const MarchGrid& g, MarchRays& rays) {
  MarchRays r = rays;
  const auto n = static_cast<float>(g.block_side);
  const float side = 1 / n;
  for (std::int32_t going = 1; going;) {
    float s[kMarchLanes], p[3][kMarchLanes];
    std::int32_t at[kMarchLanes] = {}, clear[kMarchLanes], steps[kMarchLanes];
    for (int a = 0; a < 3; ++a)
      for (int i = 0; i < kMarchLanes; ++i) p[a][i] = r.o[a][i] + r.near[i] * r.d[a][i];
    for (int i = 0; i < kMarchLanes; ++i) s[i] = scale_at(p[0][i], p[1][i], p[2][i]);
    for (int a = 2; a >= 0; --a)
      for (int i = 0; i < kMarchLanes; ++i) {
        const float c = 0.5f + contraction(s[i]) * (p[a][i] - 0.5f);
        at[i] = at[i] * g.block_side + static_cast<std::int32_t>(clamped(c * n, n - 0.5f));
      }
    for (int i = 0; i < kMarchLanes; ++i) clear[i] = g.clearance[at[i]];
    going = 0;
    for (int i = 0; i < kMarchLanes; ++i) {
      const std::int32_t goes = (clear[i] > 0) & (s[i] < kMarchFarthest) & (r.k[i] < kMarchMost);
      const std::int32_t jump = contracted_steps(static_cast<float>(clear[i]), side, s[i], r.step[i]);
      steps[i] = goes ? jump : 0;
      going |= goes;
    }
    for (std::int32_t left = going; left;) {
      left = 0;
      for (int i = 0; i < kMarchLanes; ++i) {
        const float scale = scale_at(r.o[0][i] + r.near[i] * r.d[0][i], r.o[1][i] + r.near[i] * r.d[1][i],
                                     r.o[2][i] + r.near[i] * r.d[2][i]);
        const float next = r.near[i] + r.step[i] * scale;
        const std::int32_t goes = steps[i] > 0;
        r.near[i] = goes ? next : r.near[i];
        r.k[i] += goes;
        steps[i] -= goes;
        left |= steps[i] > 0;
      }
    }
  }
  rays = r;
}

std::int64_t march_contracted(const MarchGrid& g, MarchRay& ray, std::int64_t max, float* out, float* x) {
  MarchRay r = ray;
  const auto n = static_cast<float>(g.resolution);
  std::int64_t count = 0;
  bool ended = false;
  while (count < max && r.k < kMarchMost && !ended) {
    if (const std::int32_t steps = empty_contracted_steps(g, r)) {
      for (std::int32_t i = 0; i < steps; ++i) r.near += r.step * scale_at(r, r.near);
      r.k += steps;
      continue;
    }
    float t[kFew + 1], s[kFew], c[3][kFew];
    std::int32_t cell[3][kFew], hit[kFew];
    t[0] = r.near;
    for (int i = 0; i < kFew; ++i) {
      s[i] = scale_at(r, t[i]);
      t[i + 1] = t[i] + r.step * s[i];
    }
    for (int a = 0; a < 3; ++a)
      for (int i = 0; i < kFew; ++i) {
        c[a][i] = 0.5f + contraction(s[i]) * ((r.o[a] + t[i] * r.d[a]) - 0.5f);
        cell[a][i] = static_cast<std::int32_t>(clamped(c[a][i] * n, n - 0.5f));
      }
    for (int i = 0; i < kFew; ++i) hit[i] = occupied(g, cell[0][i], cell[1][i], cell[2][i]);
    int passed = 0;
    for (; passed < kFew && count < max && !ended; ++passed) {
      ended = !(s[passed] < kMarchFarthest);
      if (ended || !hit[passed]) continue;
      out[count] = t[passed];
      for (int a = 0; a < 3; ++a) x[3 * count + a] = c[a][passed];
      ++count;
    }
    r.near = t[passed];
    r.k += passed;
  }
  ray = r;
  return count;
}

}  // namespace fieldmark::kernels::FIELDMARK_ISA_NS
