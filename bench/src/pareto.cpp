#include <fieldmark/bench/pareto.h>
#include <fieldmark/engine/error.h>

#include <algorithm>
#include <cmath>
#include <string>

namespace fieldmark::bench {

std::vector<bool> pareto_front(std::span<const SpeedQuality> points, const ParetoMargin& margin) {
  if (!(margin.time >= 0 && margin.time < 1 && margin.psnr >= 0))
    throw ValueError("[pareto_front] margins must be at least 0, that of times below 1, got " +
                     std::to_string(margin.time) + " and " + std::to_string(margin.psnr));
  const auto valid = [](const SpeedQuality& p) { return std::isfinite(p.seconds) && !std::isnan(p.psnr); };
  const auto beats = [&](const SpeedQuality& a, const SpeedQuality& b) {
    const bool faster = a.seconds < (1 - margin.time) * b.seconds,
               slower = b.seconds < (1 - margin.time) * a.seconds;
    const bool better = a.psnr > b.psnr + margin.psnr, worse = b.psnr > a.psnr + margin.psnr;
    return valid(a) && ((faster && !worse) || (better && !slower));
  };
  std::vector<bool> front;
  for (const SpeedQuality& p : points)
    front.push_back(valid(p) && std::none_of(points.begin(), points.end(),
                                             [&](const SpeedQuality& other) { return beats(other, p); }));
  return front;
}

}  // namespace fieldmark::bench
