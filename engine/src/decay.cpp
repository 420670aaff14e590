#include <fieldmark/core/error.h>
#include <fieldmark/engine/decay.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <type_traits>

#include "number_text.h"

namespace fieldmark {
namespace {

// The value is a number of steps (Index) or a factor (double).
template <class T>
void check_argument(const char* function, const char* name, T value, bool ok, const char* want) {
  if (ok) return;
  std::string got;
  if constexpr (std::is_same_v<T, Index>)
    got = std::to_string(value);
  else
    got = detail::number_text(value);
  throw ValueError(std::string("[") + function + "] " + name + " must be " + want + ", got " + got);
}

double step_number(const char* function, Index n) {
  check_argument(function, "n", n, n >= 0, "at least 0");
  return static_cast<double>(n);
}

}  // namespace

double cosine_decay(Index n, Index steps, double last) {
  const double at = step_number("cosine_decay", n), total = static_cast<double>(steps);
  check_argument("cosine_decay", "steps", steps, steps > 0, "positive");
  check_argument("cosine_decay", "last", last, last >= 0 && last <= 1, "in [0, 1]");
  return last + (1 - last) * (1 + std::cos(std::numbers::pi * std::min(at, total) / total)) / 2;
}

double step_decay(Index n, Index every, double factor) {
  step_number("step_decay", n);
  check_argument("step_decay", "every", every, every > 0, "positive");
  check_argument("step_decay", "factor", factor, factor > 0 && factor <= 1, "in (0, 1]");
  return std::pow(factor, static_cast<double>(n / every));
}

double exponential_decay(Index n, double factor) {
  const double at = step_number("exponential_decay", n);
  check_argument("exponential_decay", "factor", factor, factor > 0 && factor <= 1, "in (0, 1]");
  return std::pow(factor, at);
}

double warm_up(Index n, Index steps) {
  const double at = step_number("warm_up", n);
  check_argument("warm_up", "steps", steps, steps >= 0, "at least 0");
  return steps == 0 ? 1 : std::min(1.0, (at + 1) / static_cast<double>(steps));
}

}  // namespace fieldmark
