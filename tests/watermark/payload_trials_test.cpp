#include <fieldmark/engine/error.h>
#include <fieldmark/watermark/payload_trials.h>

#include <cmath>

#include "support/catch.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

TEST_CASE("payload_trials: exact, wrong and missing payloads are counted apart") {
  const PayloadCodec codec(100);
  const CounterRng rng(1);
  const Payload sent = random_payload(codec, rng, 0), other = random_payload(codec, rng, 1);
  CHECK(sent.value.size() == 10);
  CHECK(sent == random_payload(codec, rng, 0));
  CHECK_FALSE(sent == other);
  std::vector<double> logits;
  for (auto bit : codec.encode(sent).bits) logits.push_back(bit ? 1.0 : -1.0);
  PayloadTrials trials(codec);
  CHECK(std::isnan(trials.accuracy().share()));
  trials.add(logits, sent);
  trials.add(logits, other);
  logits[5] *= -1;
  logits[70] *= -1;
  trials.add(logits, sent);
  trials.add(std::vector<double>(100, 0.0), sent);
  CHECK(trials.accuracy().trials == 4);
  CHECK(trials.accuracy().exact == 2);
  CHECK(trials.accuracy().wrong == 1);
  CHECK(trials.accuracy().corrected == 2);
  CHECK(trials.accuracy().share() == 0.5);
  CHECK(random_payload(PayloadCodec(48), rng, 0).value.size() == 8);
  CHECK_THROWS_WITH(random_payload(PayloadCodec(16), rng, 0),
                    "[random_payload] codec: messages of 16 bits hold no payload");
}

TEST_CASE("payload_trials: intervals are Wilson's") {
  // Its ends solve (p - x)^2 = z^2 x (1 - x) / n.
  const double z = 1.959963984540054;
  for (const auto& [k, n] : {std::pair<Index, Index>{3, 10}, {0, 300}, {300, 300}, {297, 300}, {1, 1}}) {
    const auto [low, high] = wilson_interval(k, n);
    const double p = static_cast<double>(k) / static_cast<double>(n);
    for (double x : {low, high})
      CHECK((p - x) * (p - x) == Approx(z * z * x * (1 - x) / static_cast<double>(n)).margin(1e-15));
    CHECK(low <= p);
    CHECK(high >= p);
    CHECK(low < high);
  }
  CHECK(wilson_interval(0, 0).low == 0);
  CHECK(wilson_interval(0, 0).high == 1);
  CHECK_THROWS_WITH(wilson_interval(3, 2), "[wilson_interval] successes must be 0 to 2 (the trials), got 3");
}
