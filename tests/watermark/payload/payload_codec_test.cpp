#include <fieldmark/core/error.h>
#include <fieldmark/engine/random.h>
#include <fieldmark/watermark/payload/payload_codec.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "support/catch.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

namespace {

constexpr const char* kCodecUuid = "01234567-89ab-cdef-0123-456789abcdef";

std::vector<double> logits_of(const Message& message) {
  std::vector<double> logits;
  for (auto bit : message.bits) logits.push_back(bit ? 1.0 : -1.0);
  return logits;
}

// Flips the sign of `count` logits, chosen by rng at a.
void spoil(std::vector<double>& logits, Index count, Index among, const CounterRng& rng, std::uint64_t a) {
  const auto order = permutation(among, rng, a);
  for (Index i = 0; i < count; ++i)
    logits[static_cast<std::size_t>(order[static_cast<std::size_t>(i)])] *= -1;
}

}  // namespace

TEST_CASE(
    "payload_codec: 100 bits are 4 of version, 40 of data and 56 of check, and 9 wrong ones are corrected") {
  const PayloadCodec codec(100);
  const auto layouts = codec.layouts();
  const auto forty =
      std::find_if(layouts.begin(), layouts.end(), [](const auto& l) { return l.data_bits == 40; });
  REQUIRE(forty != layouts.end());
  CHECK(forty->check_bits == 56);
  CHECK(forty->zero_bits == 0);
  CHECK(forty->spare_bits == 0);
  CHECK(forty->corrects == 9);
  const Message message = codec.encode({PayloadKind::text, "hello"});
  CHECK(to_hex(message).substr(0, 11) == "a68656c6c6f");  // version 10: text of 40 bits
}

TEST_CASE("payload_codec: layouts fill their messages, and chances are those of their spheres") {
  for (Index n = 1; n <= 256; n += 5) {
    const PayloadCodec codec(n);
    double sum = 0;
    Index before = 0;
    for (const PayloadLayout& l : codec.layouts()) {
      CHECK(4 + l.data_bits + l.zero_bits + l.check_bits + l.spare_bits == n);
      CHECK(l.corrects >= 1);
      CHECK(l.chance <= PayloadCodec::kMostChance);
      CHECK(l.data_bits > before);
      before = l.data_bits;
      sum += l.chance + PayloadCodec::kMostSoftChance;
    }
    CHECK(codec.chance() == Approx(sum));
  }
  CHECK(PayloadCodec(24).layouts().empty());
  CHECK(PayloadCodec(48).layouts().front().corrects == 5);
  CHECK(PayloadCodec(255).layouts().back().data_bits == 128);
  const auto l = PayloadCodec(64).layouts()[2];
  CHECK(l.data_bits == 32);
  const double words = 1 + 64 + 2016 + 41664 + 635376,
               payloads = std::ldexp(1.0, 32) + payload_count(PayloadKind::text, 32);
  CHECK(l.corrects == 4);
  CHECK(l.chance == Approx(payloads * words / std::ldexp(1.0, 64)).epsilon(1e-12));

  // What is read reports the chance over all layouts, because the best of them is reported.
  const PayloadCodec codec(64);
  const auto clean = codec.read(logits_of(codec.encode({PayloadKind::hex, "deadbeef"})));
  REQUIRE(clean);
  CHECK(clean->chance == Approx(static_cast<double>(codec.layouts().size()) * payloads *
                                std::exp(log_chance_of_agreement(std::vector<double>(64, 1.0), 64)))
                             .epsilon(1e-3));
}

TEST_CASE("payload_codec: payloads come back through as many wrong bits as are promised, anywhere") {
  const CounterRng rng(1);
  std::uint64_t place = 0;
  const std::pair<Index, Payload> payloads[] = {
      {48, {PayloadKind::hex, "beef"}},       {48, {PayloadKind::text, "ok"}},
      {64, {PayloadKind::text, "\xc3\xa9t"}}, {100, {PayloadKind::hex, "0123456789"}},
      {100, {PayloadKind::text, "hello"}},    {128, {PayloadKind::text, "marked!!"}},
      {255, {PayloadKind::uuid, kCodecUuid}}, {256, {PayloadKind::text, "0123456789abcdef"}},
      {256, {PayloadKind::hex, "1f"}}};
  for (const auto& [n, payload] : payloads) {
    const PayloadCodec codec(n);
    const Message message = codec.encode(payload);
    REQUIRE(message.size() == n);
    const auto value = codec.payload(message);
    REQUIRE(value);
    CHECK(codec.encode(*value) == message);
    CHECK(value->kind == payload.kind);
    CHECK(value->value.ends_with(payload.value));
    for (const PayloadLayout& layout : codec.layouts()) {
      if (layout.data_bits < payload_bits(payload)) continue;
      for (Index errors = 0; errors <= layout.corrects; errors += 1 + layout.corrects / 6) {
        auto logits = logits_of(message);
        spoil(logits, errors, n - layout.spare_bits, rng, ++place);
        const auto read = codec.read(logits);
        REQUIRE(read);
        CHECK(read->payload == *value);
        CHECK(read->corrected == errors);
      }
      break;
    }
  }
}

TEST_CASE("payload_codec: weak bits may be wrong, or absent, beyond what is promised") {
  const PayloadCodec codec(100);
  const Payload payload{PayloadKind::hex, "feedfacade"};
  const Message message = codec.encode(payload);
  const CounterRng rng(2);
  int read_signs = 0, read_strengths = 0, absent = 0;
  for (std::uint64_t trial = 0; trial < 15; ++trial) {
    std::vector<double> logits = logits_of(message), signs;
    for (std::size_t i = 0; i < logits.size(); ++i)
      logits[i] += static_cast<double>(rng.normal2(trial, i)[0]) / 1.3;
    for (double x : logits) signs.push_back(x > 0 ? 1.0 : -1.0);
    const auto by_strength = codec.read(logits), by_sign = codec.read(signs);
    read_strengths += by_strength && by_strength->payload == payload;
    read_signs += by_sign && by_sign->payload == payload;
    auto half = logits_of(message);
    const auto order = permutation(100, rng, trial + 1000);
    for (std::size_t i = 0; i < 30; ++i) half[static_cast<std::size_t>(order[i])] = 0;
    const auto filled = codec.read(half);
    absent += filled && filled->payload == payload;
  }
  CHECK(read_signs <= 10);  // 10% of the bits are wrong
  CHECK(read_strengths >= 13);
  CHECK(absent == 15);
}

TEST_CASE("payload_codec: random bits are seldom a payload, and as seldom as is told") {
  const CounterRng rng(3);
  const PayloadCodec codec(32);
  int signs_read = 0, strengths_read = 0;
  constexpr int kTrials = 4000;
  for (std::uint64_t trial = 0; trial < kTrials; ++trial) {
    std::vector<double> strengths, signs;
    for (std::uint64_t i = 0; i < 32; ++i) strengths.push_back(static_cast<double>(rng.normal2(trial, i)[0]));
    for (double x : strengths) signs.push_back(x > 0 ? 1.0 : -1.0);
    signs_read += codec.read(signs).has_value();
    strengths_read += codec.read(strengths).has_value();
  }
  const double bound = codec.chance() * kTrials;
  CHECK(signs_read <= bound + 4 * std::sqrt(bound));
  CHECK(strengths_read <= bound + 4 * std::sqrt(bound));
  CHECK(signs_read + strengths_read > 0);  // guards against an empty test; the bench measures the rate
  // Logits as an image without evidence, an all-dark or an all-bright one may give them.
  for (Index n : {48, 64, 100, 128, 255, 256}) {
    const PayloadCodec other(n);
    for (double x : {0.0, 1.0, -1.0})
      CHECK_FALSE(other.read(std::vector<double>(static_cast<std::size_t>(n), x)));
  }
}

TEST_CASE("payload_codec: the bound on chance agreement holds, and is near where it can be known") {
  const std::vector<double> flat(100, 2.0);
  double tail = 0, term = std::ldexp(1.0, -100);  // at most 9 of 100 fair bits wrong
  for (int i = 0; i <= 9; ++i) {
    tail += term;
    term *= (100.0 - i) / (i + 1);
  }
  const double bound = log_chance_of_agreement(flat, 2.0 * (100 - 2 * 9));
  CHECK(bound >= std::log(tail));
  CHECK(bound < std::log(tail) + 3);
  CHECK(log_chance_of_agreement(flat, 200) == Approx(-100 * std::log(2.0)).epsilon(1e-6));
  CHECK(log_chance_of_agreement(flat, 0) == 0);
  CHECK(log_chance_of_agreement(flat, -3) == 0);
  CHECK(log_chance_of_agreement(std::vector<double>(5, 0.0), 0) == 0);
  const std::vector<double> mixed{3, -1, 0.5, 0, 2, 1e-3};
  const double most = 6.501;
  int at_least = 0;  // among all 64 choices of signs
  for (unsigned signs = 0; signs < 64; ++signs) {
    double sum = 0;
    for (std::size_t i = 0; i < 6; ++i) sum += (signs >> i & 1 ? 1 : -1) * std::abs(mixed[i]);
    at_least += sum >= 5 - 1e-9;
  }
  CHECK(log_chance_of_agreement(mixed, 5) >= std::log(at_least / 64.0));
  CHECK(log_chance_of_agreement(mixed, most) == Approx(-5 * std::log(2.0)).epsilon(1e-3));
}

TEST_CASE("payload_codec: the length that is named is the least that holds the payload") {
  const Payload text{PayloadKind::text, "hello"};
  std::string what;
  try {
    PayloadCodec(48).encode(text);
  } catch (const ValueError& e) {
    what = e.what();
  }
  Index least = 49;
  const auto fits = [&] {
    try {
      PayloadCodec(least).encode(text);
      return true;
    } catch (const ValueError&) {
      return false;
    }
  };
  while (least <= 256 && !fits()) ++least;
  CHECK_THAT(what, Contains("it needs a message of " + std::to_string(least) + " bits"));
  CHECK_THROWS_WITH(PayloadCodec(256).encode({PayloadKind::text, std::string(17, 'a')}), Contains("17"));
}

TEST_CASE("payload_codec: what does not fit is named") {
  CHECK_THROWS_WITH(PayloadCodec(0), "[PayloadCodec] raw_bits must be 1 to 256, got 0");
  CHECK_THROWS_WITH(PayloadCodec(257), "[PayloadCodec] raw_bits must be 1 to 256, got 257");
  CHECK_THROWS_WITH(PayloadCodec(48).encode({PayloadKind::text, "too long"}),
                    Contains("payload: has 64 bits, a message of 48 bits can hold at most 32; it needs"));
  CHECK_THROWS_WITH(PayloadCodec(16).encode({PayloadKind::hex, "1"}),
                    Contains("payload: has 4 bits, a message of 16 bits can hold no payload; it needs"));
  CHECK_THROWS_WITH(
      PayloadCodec(100).encode({PayloadKind::uuid, kCodecUuid}),
      "[PayloadCodec::encode] payload: has 128 bits, a message of 100 bits can hold at most 64; it needs a "
      "message of 147 bits");
  CHECK_THROWS_AS(PayloadCodec(100).encode({PayloadKind::text, "\xff"}), ValueError);
  const PayloadCodec codec(48);
  CHECK_FALSE(codec.payload(message_from_hex("123456789abc", 48)));
  CHECK_THROWS_WITH(codec.payload(Message{{1, 0}}), "[PayloadCodec::payload] must have 48 bits, got 2");
  CHECK_THROWS_WITH(codec.read(std::vector<double>(47)), "[PayloadCodec::read] must have 48 bits, got 47");
  std::vector<double> logits(48, 1.0);
  logits[3] = std::numeric_limits<double>::infinity();
  CHECK_THROWS_WITH(codec.read(logits), "[PayloadCodec::read] logits must be finite");
}
