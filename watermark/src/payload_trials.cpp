#include <fieldmark/engine/error.h>
#include <fieldmark/watermark/payload_trials.h>

#include <cmath>
#include <string>

namespace fieldmark::watermark {

double PayloadAccuracy::share() const {
  return trials > 0 ? static_cast<double>(exact) / static_cast<double>(trials) : std::nan("");
}

ShareInterval wilson_interval(Index successes, Index trials) {
  if (successes < 0 || successes > trials)
    throw ValueError("[wilson_interval] successes must be 0 to " + std::to_string(trials) +
                     " (the trials), got " + std::to_string(successes));
  if (trials == 0) return {};
  constexpr double z = 1.959963984540054;
  const double n = static_cast<double>(trials), p = static_cast<double>(successes) / n;
  const double middle = p + z * z / (2 * n), half = z * std::sqrt(p * (1 - p) / n + z * z / (4 * n * n)),
               scale = 1 + z * z / n;
  // At the ends rounding would leave a little.
  return {successes == 0 ? 0.0 : (middle - half) / scale,
          successes == trials ? 1.0 : (middle + half) / scale};
}

void PayloadTrials::add(std::span<const double> logit, const Payload& sent) {
  ++accuracy_.trials;
  const auto read = codec_->read(logit);
  if (!read) return;
  if (read->payload == sent) {
    ++accuracy_.exact;
    accuracy_.corrected += read->corrected;
  } else {
    ++accuracy_.wrong;
  }
}

Payload random_payload(const PayloadCodec& codec, const CounterRng& rng, std::uint64_t index) {
  Index bits = 0;
  for (const PayloadLayout& layout : codec.layouts())
    if (layout.data_bits <= 40) bits = layout.data_bits;
  if (bits == 0)
    throw ValueError("[random_payload] codec: messages of " + std::to_string(codec.raw_bits()) +
                     " bits hold no payload");
  return {PayloadKind::hex, to_hex(random_message(bits, rng, index))};
}

}  // namespace fieldmark::watermark
