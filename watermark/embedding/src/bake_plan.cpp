#include "bake_plan.h"

#include <algorithm>
#include <cmath>

namespace fieldmark::watermark {
namespace {

// Returns the range of the colour networks' parameters, which are contiguous.
AdamRange colour_range(const ParamStore<float>& params, double lr_factor) {
  AdamRange range{.begin = params.size(), .lr_factor = lr_factor};
  for (const auto& e : params.entries())
    if (nerf::Field<float>::is_colour(e.name)) {
      range.begin = std::min(range.begin, e.offset);
      range.end = e.offset + e.shape.size();
    }
  return range;
}

void add_table(const nerf::RadianceField& field, double lr_factor, std::vector<AdamRange>& ranges) {
  const nerf::HashEncoding<float>& encoding = field.field.encoding();
  const bool object = is_object_of_hash(field);
  const auto begin_of = [&](int level) {
    return field.field.network_size() + encoding.first_row(level) * 2 * encoding.features();
  };
  for (int level = 0; level < encoding.levels(); ++level) {
    const double coarser = kMarkResolution / static_cast<double>(encoding.resolution(level));
    ranges.push_back({.begin = begin_of(level),
                      .end = begin_of(level + 1),
                      .lr_factor = lr_factor * (object ? std::min(1., std::pow(coarser, 3)) : 1.),
                      .skip_zero = true});
  }
}

}  // namespace

bool is_object_of_hash(const nerf::RadianceField& field) {
  return field.field.has_table() && field.space.kind == nerf::SpaceKind::cube;
}

BakePlan bake_plan(const nerf::RadianceField& field) {
  const bool object = is_object_of_hash(field);
  if (!field.field.has_table()) return {.chunks = 32, .ranges = {colour_range(field.params, 0.01)}};
  // The parameters of the density are outside the ranges.
  BakePlan plan{.chunks = object ? 128 : 32, .ranges = {colour_range(field.params, object ? 0.2 : 0.04)}};
  add_table(field, object ? 1 : 0.2, plan.ranges);
  return plan;
}

}  // namespace fieldmark::watermark
