#pragma once
#include <fieldmark/engine/random.h>
#include <fieldmark/watermark/payload_codec.h>

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace fieldmark::watermark {

/// How often a payload was read as it had been sent.
struct PayloadAccuracy {
  Index trials = 0;     ///< readings
  Index exact = 0;      ///< that told the payload that was sent
  Index wrong = 0;      ///< that told another one; the others told none
  Index corrected = 0;  ///< bits corrected in the exact ones
  /// exact / trials; NaN without trials.
  double share() const;
};

/// 95% interval of a share by Wilson's score: of successes among independent trials.
///   (p + z^2 / 2n -+ z sqrt(p (1 - p) / n + z^2 / 4n^2)) / (1 + z^2 / n),  z = 1.96
/// Source: Wilson 1927.
struct ShareInterval {
  double low = 0;   ///< at least 0
  double high = 1;  ///< at most 1
};
/// @param successes  0 to trials; without trials the interval is [0, 1]   @throws ValueError otherwise
ShareInterval wilson_interval(Index successes, Index trials);

/// Reads payloads from logits and compares them with what was sent.
class PayloadTrials {
 public:
  /// @param codec  must outlive this
  explicit PayloadTrials(const PayloadCodec& codec) : codec_(&codec) {}
  /// Counts one reading.
  void add(std::span<const double> logit, const Payload& sent);
  /// So far.
  const PayloadAccuracy& accuracy() const { return accuracy_; }

 private:
  const PayloadCodec* codec_;
  PayloadAccuracy accuracy_;
};

/// Random hexadecimal payload for measuring, a function of (rng, index), of the longest data up to 40 bits
/// that the codec's messages hold.   @throws ValueError if they hold none
Payload random_payload(const PayloadCodec& codec, const CounterRng& rng, std::uint64_t index);

}  // namespace fieldmark::watermark
