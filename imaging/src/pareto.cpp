#include <fieldmark/core/error.h>
#include <fieldmark/core/number_text.h>
#include <fieldmark/imaging/pareto.h>

#include <algorithm>
#include <cmath>
#include <string>

namespace fieldmark::bench {

namespace {

using Figures = std::vector<double>;

bool valid(const Figures& p) {
  return std::none_of(p.begin(), p.end(), [](double x) { return std::isnan(x); });
}

bool beats(const Figures& a, const Figures& b, std::span<const double> margins) {
  bool better = false;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (b[i] > a[i] + margins[i]) return false;
    better = better || a[i] > b[i] + margins[i];
  }
  return better && valid(a);
}

}  // namespace

std::vector<bool> pareto_front(std::span<const Figures> points, std::span<const double> margins) {
  for (const double margin : margins)
    if (!(margin >= 0))
      throw ValueError("[pareto_front] margins must be at least 0, got " + number_text(margin));
  for (const Figures& p : points)
    if (p.size() != margins.size())
      throw ValueError("[pareto_front] points must have a figure for each margin (" +
                       std::to_string(margins.size()) + "), got " + std::to_string(p.size()));
  std::vector<bool> front;
  for (const Figures& p : points)
    front.push_back(valid(p) && std::none_of(points.begin(), points.end(),
                                             [&](const Figures& other) { return beats(other, p, margins); }));
  return front;
}

std::vector<bool> pareto_front(std::span<const SpeedQuality> points, const ParetoMargin& margin) {
  if (!(margin.time >= 0 && margin.time < 1 && margin.psnr >= 0))
    throw ValueError("[pareto_front] margins must be at least 0, that of times below 1, got " +
                     number_text(margin.time) + " and " + number_text(margin.psnr));
  // Relative time differences are differences of logarithms.
  std::vector<Figures> figures;
  for (const SpeedQuality& p : points)
    figures.push_back({std::isfinite(p.seconds) ? -std::log(p.seconds) : std::nan(""), p.psnr, -p.bytes});
  const double margins[] = {-std::log1p(-margin.time), margin.psnr, 0};
  return pareto_front(figures, margins);
}

}  // namespace fieldmark::bench
