#include <fieldmark/core/error.h>
#include <fieldmark/core/number_text.h>
#include <fieldmark/engine/decay.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

namespace fieldmark {
namespace {

double step_number(const char* function, Index n) {
  check_number(function, "n", n, n >= 0, "at least 0");
  return static_cast<double>(n);
}

}  // namespace

double cosine_decay(Index n, Index steps, double last) {
  const double at = step_number("cosine_decay", n), total = static_cast<double>(steps);
  check_number("cosine_decay", "steps", steps, steps > 0, "positive");
  check_number("cosine_decay", "last", last, last >= 0 && last <= 1, "in [0, 1]");
  return last + (1 - last) * (1 + std::cos(std::numbers::pi * std::min(at, total) / total)) / 2;
}

double step_decay(Index n, Index every, double factor) {
  step_number("step_decay", n);
  check_number("step_decay", "every", every, every > 0, "positive");
  check_number("step_decay", "factor", factor, factor > 0 && factor <= 1, "in (0, 1]");
  return std::pow(factor, static_cast<double>(n / every));
}

double exponential_decay(Index n, double factor) {
  const double at = step_number("exponential_decay", n);
  check_number("exponential_decay", "factor", factor, factor > 0 && factor <= 1, "in (0, 1]");
  return std::pow(factor, at);
}

double warm_up(Index n, Index steps) {
  const double at = step_number("warm_up", n);
  check_number("warm_up", "steps", steps, steps >= 0, "at least 0");
  return steps == 0 ? 1 : std::min(1.0, (at + 1) / static_cast<double>(steps));
}

}  // namespace fieldmark
