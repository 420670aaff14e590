#include "kernels/feature_distance.h"

#include <cmath>
#include <cstdint>

#include "support/each_isa.h"
#include "support/random.h"
#include "support/worst.h"

using namespace fieldmark;

TEST_CASE("kernels/feature_distance: float equals a plain loop in double for every number of channels") {
  using namespace fieldmark::kernels;
  for (std::int64_t channels = 1; channels <= 130; ++channels) {
    CAPTURE(channels);
    const std::int64_t pixels = 3;
    const auto a = uniform<float>({pixels, channels}, -1, 1, 1),
               b = uniform<float>({pixels, channels}, -1, 1, 2), w = uniform<float>({channels}, 0, 1, 3);
    double want = 0;
    std::vector<double> gradient(a.data.size());
    for (std::int64_t p = 0; p < pixels; ++p) {
      const auto at = [&](const Tensor<float>& x, std::int64_t c) {
        return static_cast<double>(x[p * channels + c]);
      };
      double na = 0, nb = 0, along = 0;
      for (std::int64_t c = 0; c < channels; ++c) {
        na += at(a, c) * at(a, c);
        nb += at(b, c) * at(b, c);
      }
      na = std::sqrt(na);
      nb = std::sqrt(nb);
      const auto d = [&](std::int64_t c) { return at(a, c) / na - at(b, c) / nb; };
      for (std::int64_t c = 0; c < channels; ++c) {
        want += static_cast<double>(w[c]) * d(c) * d(c);
        along += 2 * static_cast<double>(w[c]) * d(c) * at(a, c);
      }
      for (std::int64_t c = 0; c < channels; ++c)
        gradient[static_cast<std::size_t>(p * channels + c)] =
            (2 * static_cast<double>(w[c]) * d(c) - at(a, c) * along / (na * na)) / na;
    }
    each_isa([&] {
      const FeaturePair<float> pair{a.data.data(), b.data.data(), w.data.data(), pixels, channels};
      CHECK(std::abs(FIELDMARK_KERNEL(feature_distance<float>)(pair) - want) < 2e-6 * (want + 1e-3));
      std::vector<float> da(a.data.size(), 1.f);
      FIELDMARK_KERNEL(feature_distance_backward<float>)(pair, 0.5f, true, da.data());
      double worst = 0, most = 1;
      for (std::size_t i = 0; i < da.size(); ++i) {
        raise_to(worst, std::abs(static_cast<double>(da[i]) - 1 - 0.5 * gradient[i]));
        raise_to(most, std::abs(gradient[i]));
      }
      CHECK(worst < 2e-6 * most);
    });
  }
}
