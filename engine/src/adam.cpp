#include <fieldmark/core/number_text.h>
#include <fieldmark/engine/adam.h>
#include <fieldmark/engine/parallel.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "kernels/adam.h"
#include "optimiser_checks.h"

namespace fieldmark {
namespace kernels {
namespace {
void adam(float* x, float* g, float* m, float* v, Index n, const AdamScalars<float>& s) {
  FIELDMARK_KERNEL(adam_f32)(x, g, m, v, n, s);
}
void adam(double* x, double* g, double* m, double* v, Index n, const AdamScalars<double>& s) {
  FIELDMARK_KERNEL(adam_f64)(x, g, m, v, n, s);
}
}  // namespace
}  // namespace kernels

namespace {

// 16k floats of four arrays are 256 KiB, which fits a core's L2 cache.
constexpr Index kGrain = 16384;

bool same_settings(const AdamRange& a, const AdamRange& b) {
  return a.lr_factor == b.lr_factor && a.skip_zero == b.skip_zero && a.weight_decay == b.weight_decay;
}

}  // namespace

template <class T>
Adam<T>::Adam(Index n, AdamOptions o) : options_(o) {
  check_number("Adam", "n", n, n >= 0, "at least 0");
  check_number("Adam", "lr", o.lr, o.lr > 0, "positive");
  check_number("Adam", "beta1", o.beta1, o.beta1 >= 0 && o.beta1 < 1, "in [0, 1)");
  check_number("Adam", "beta2", o.beta2, o.beta2 >= 0 && o.beta2 < 1, "in [0, 1)");
  check_number("Adam", "eps", o.eps, o.eps > 0, "positive");
  check_number("Adam", "weight_decay", o.weight_decay, o.weight_decay >= 0, "at least 0");
  mean_.resize(static_cast<std::size_t>(n));
  mean_square_.resize(static_cast<std::size_t>(n));
}

template <class T>
Adam<T>::Adam(const ParamStore<T>& store, AdamOptions o) : Adam(store.size(), o) {
  for (const auto& e : store.entries())
    if (!is_trained(e.role)) running_.emplace_back(e.offset, e.offset + e.shape.size());
}

template <class T>
void Adam<T>::step(std::span<T> values, std::span<T> grads, double lr_factor) {
  const AdamRange all{.begin = 0,
                      .end = static_cast<Index>(mean_.size()),
                      .lr_factor = lr_factor,
                      .skip_zero = options_.skip_zero,
                      .weight_decay = options_.weight_decay};
  step(values, grads, std::span(&all, 1));
}

template <class T>
void Adam<T>::check(std::span<T> values, std::span<T> grads, std::span<const AdamRange> ranges) const {
  detail::check_step_size("Adam", "values", values.size(), mean_.size());
  detail::check_step_size("Adam", "grads", grads.size(), mean_.size());
  const Index n = static_cast<Index>(mean_.size());
  for (const AdamRange& r : ranges)
    if (r.begin < 0 || r.end < r.begin || r.end > n)
      throw ValueError("[Adam::step] ranges: each must lie within [0, " + std::to_string(n) + "], got [" +
                       std::to_string(r.begin) + ", " + std::to_string(r.end) + "]");
}

template <class T>
void Adam<T>::step(std::span<T> values, std::span<T> grads, std::span<const AdamRange> ranges) {
  check(values, grads, ranges);
  ++steps_;
  for (const AdamRange& r : ranges) update(values, grads, r);
}

template <class T>
void Adam<T>::extend_step(std::span<T> values, std::span<T> grads, const AdamRange& range) {
  check(values, grads, std::span(&range, 1));
  if (steps_ == 0) throw ValueError("[Adam::extend_step] no step was taken before");
  update(values, grads, range);
}

template <class T>
void Adam<T>::update(std::span<T> values, std::span<T> grads, const AdamRange& r) {
  AdamRange part = r;
  for (const auto& [begin, end] : running_) {
    if (end <= part.begin || begin >= r.end) continue;
    part.end = std::max(begin, part.begin);
    update_trained(values, grads, part);
    part.begin = std::min(end, r.end);
  }
  part.end = r.end;
  update_trained(values, grads, part);
}

template <class T>
void Adam<T>::update_trained(std::span<T> values, std::span<T> grads, const AdamRange& r) {
  const double t = static_cast<double>(steps_), lr = options_.lr * r.lr_factor;
  const kernels::AdamScalars<T> scalars{
      .beta1 = static_cast<T>(options_.beta1),
      .beta2 = static_cast<T>(options_.beta2),
      .eps = static_cast<T>(options_.eps),
      .step = static_cast<T>(lr / (1 - std::pow(options_.beta1, t))),
      .root = static_cast<T>(1 / std::sqrt(1 - std::pow(options_.beta2, t))),
      .shrink = static_cast<T>(1 - lr * r.weight_decay),
      .skip_zero = r.skip_zero,
      .zero_grads = options_.zero_grads,
  };
  parallel_for(r.end - r.begin, kGrain, [&](Index begin, Index end) {
    const Index at = r.begin + begin;
    kernels::adam(values.data() + at, grads.data() + at, mean_.data() + at, mean_square_.data() + at,
                  end - begin, scalars);
  });
}

template <class T>
void Adam<T>::set_steps(Index steps) {
  check_number("Adam::set_steps", "steps", steps, steps >= 0, "at least 0");
  steps_ = steps;
}

template <class T>
std::vector<AdamRange> adam_ranges(const ParamStore<T>& store, const std::vector<AdamGroup>& groups) {
  const auto entries = store.entries();
  for (const AdamGroup& g : groups) detail::check_pattern("adam_ranges", store, g.names);
  std::vector<AdamRange> ranges;
  bool joins = false;  // the previous entry ends the last range
  for (const auto& e : entries) {
    const auto group =
        std::ranges::find_if(groups, [&](const AdamGroup& g) { return name_matches(g.names, e.name); });
    const bool trained = is_trained(e.role) && group != groups.end();
    if (trained && !(joins && same_settings(ranges.back(), group->settings))) {
      ranges.push_back(group->settings);
      ranges.back().begin = e.offset;
    }
    if (trained) ranges.back().end = e.offset + e.shape.size();
    joins = trained;
  }
  return ranges;
}

template class Adam<float>;
template class Adam<double>;
template std::vector<AdamRange> adam_ranges(const ParamStore<float>&, const std::vector<AdamGroup>&);
template std::vector<AdamRange> adam_ranges(const ParamStore<double>&, const std::vector<AdamGroup>&);

}  // namespace fieldmark
