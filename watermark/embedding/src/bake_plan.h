#pragma once
#include <fieldmark/engine/adam.h>
#include <fieldmark/nerf/radiance_field.h>

#include <vector>

// What baking trains in a field, and with how many rays and which step sizes. Private.
namespace fieldmark::watermark {

// Cells per axis that suffice for a mark on an object.
inline constexpr double kMarkResolution = 128;

// True for an object in a hash field, which bakes with many rays, large steps, emphasis and guidance.
bool is_object_of_hash(const nerf::RadianceField& field);

struct BakePlan {
  Index chunks;                   // of rays per step
  std::vector<AdamRange> ranges;  // colour networks and table, step sizes relative to the schedule's
};

// Rays of objects are short: there is time for many of them and for large steps, without which colours learn
// a mark from all directions too faintly. Elsewhere there is time for a tenth of the steps.
//
// A mark has little detail finer than kMarkResolution. On an object's finer levels, a row of the table sees
// fewer rays and learns mostly noise, so its step shrinks with the volume of a cell.
BakePlan bake_plan(const nerf::RadianceField& field);

}  // namespace fieldmark::watermark
