#include <fieldmark/core/error.h>
#include <fieldmark/watermark/attacks/payload_trials.h>
#include <fieldmark/watermark/evidence/evidence.h>

#include <cmath>
#include <utility>

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

TEST_CASE("payload_trials: views of a group are added before they are read") {
  const PayloadCodec codec(48);
  const Payload sent = random_payload(codec, CounterRng(2), 0);
  const Message message = codec.encode(sent), plain = message_from_hex("123456789abc", 48);
  REQUIRE_FALSE(codec.payload(plain));
  // One cell per bit; each of two views shows one half of them.
  CellCode code;
  std::vector<double> first(48), second(48), whole(48);
  for (std::size_t i = 0; i < 48; ++i) {
    code.bit.push_back(static_cast<std::int32_t>(i));
    code.sign.push_back(1);
    whole[i] = message.bits[i] ? 1 : -1;
    (i % 2 ? first : second)[i] = whole[i];
  }
  PayloadViews two(code, 48, 2), one(code, 48, 1);
  for (Index view = 0; view < 5; ++view) {
    two.add(view, "", view % 2 ? first : second, message);
    two.add(view, "blur_1", view % 2 ? whole : first, plain);
    one.add(view, "", first, message);
    one.add(view, "blur_1", whole, message);
  }
  REQUIRE(two.accuracies().size() == 1);  // the other name sent no payload
  CHECK(two.accuracies().at("").trials == 2);
  CHECK(two.accuracies().at("").exact == 2);
  CHECK(one.accuracies().at("").trials == 5);
  CHECK(one.accuracies().at("").exact == 0);
  CHECK(one.accuracies().at("blur_1").exact == 5);
  CHECK_THROWS_WITH(PayloadViews(code, 48, 0), "[PayloadViews] together must be at least 1, got 0");
  CHECK_THROWS_AS(one.add(0, "", std::vector<double>(3), message), ValueError);
}

TEST_CASE("payload_trials: intervals are Wilson's") {
  // The ends of the interval solve (p - x)^2 = z^2 x (1 - x) / n.
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

TEST_CASE("payload_trials: bits that an image hardly shows do not count against a payload") {
  const PayloadCodec codec(100);
  const Payload sent = random_payload(codec, CounterRng(4), 0);
  const Message message = codec.encode(sent);
  // One cell per bit; every third is a hundred times fainter and reads wrong half of the time.
  CellCode code;
  std::vector<double> evidence;
  for (std::size_t i = 0; i < 100; ++i) {
    code.bit.push_back(static_cast<std::int32_t>(i));
    code.sign.push_back(i % 2 ? 1 : -1);
    const double right = code.sign[i] * (message.bits[i] ? 1 : -1);
    evidence.push_back(i % 3 ? right : i % 6 ? -0.01 * right : 0.01 * right);
  }
  const BitReading reading = read_bits(evidence, code, 100);
  REQUIRE(match_bits(reading, message).matching == 83);
  CHECK_FALSE(codec.read(reading.logit).has_value());  // with equal strengths, 17 errors are too many
  PayloadViews views(code, 100, 1);
  views.add(0, "", evidence, message);
  CHECK(views.accuracies().at("").exact == 1);
}
