#pragma once
#include <fieldmark/engine/random.h>
#include <fieldmark/watermark/mark/cell_code.h>
#include <fieldmark/watermark/payload/payload_codec.h>

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace fieldmark::watermark {

/// Counts of correctly decoded payloads.
struct PayloadAccuracy {
  Index trials = 0;     ///< readings
  Index exact = 0;      ///< readings with the payload that was sent
  Index wrong = 0;      ///< readings with another payload; the rest gave none
  Index corrected = 0;  ///< bits corrected in the exact readings
  /// exact / trials; NaN without trials.
  double share() const;
};

/// 95% score interval for the share of successes among independent trials.
///   (p + z^2 / 2n -+ z sqrt(p (1 - p) / n + z^2 / 4n^2)) / (1 + z^2 / n),  z = 1.96
/// Source: Wilson 1927.
struct ShareInterval {
  double low = 0;   ///< at least 0
  double high = 1;  ///< at most 1
};
/// Computes the interval.   @param successes  0 to trials; without trials the interval is [0, 1]
/// @throws ValueError otherwise
ShareInterval wilson_interval(Index successes, Index trials);

/// Decodes payloads from logits and counts those that match.
class PayloadTrials {
 public:
  /// @param codec  must outlive this object
  explicit PayloadTrials(const PayloadCodec& codec) : codec_(&codec) {}
  /// Counts one reading.
  void add(std::span<const double> logit, const Payload& sent);
  /// Returns the counts so far.
  const PayloadAccuracy& accuracy() const { return accuracy_; }

 private:
  const PayloadCodec* codec_;
  PayloadAccuracy accuracy_;
};

/// Decodes payloads from the evidence of views, summed over groups of successive views, and counts those that
/// match.
class PayloadViews {
 public:
  /// @param code  of the owner; must outlive this object   @param raw_bits  length of a message, 1 to 256
  /// @param together  views per group, at least 1; all views of a group must have the same message
  /// @throws ValueError if a number is out of range
  PayloadViews(const CellCode& code, Index raw_bits, Index together);
  /// Not copyable: groups refer to members.
  PayloadViews(const PayloadViews&) = delete;
  /// Adds an image. Under each name, views come in order; messages without a payload are skipped.
  /// @param evidence  [cells]   @throws ValueError as read_bits()
  void add(Index view, const std::string& under, std::span<const double> evidence, const Message& sent);
  /// Returns the counts of complete groups by name.
  std::map<std::string, PayloadAccuracy> accuracies() const;

 private:
  struct Group {
    std::vector<double> evidence;
    PayloadTrials trials;
  };
  const CellCode* code_;
  PayloadCodec codec_;
  Index together_;
  std::map<std::string, Group> groups_;
};

/// Returns the data bits of random_payload(): the longest layout of at most 40 bits; 0 if messages hold no
/// payload.
Index random_payload_bits(const PayloadCodec& codec);
/// Draws a random hexadecimal payload for measuring, a function of (rng, index).
/// @throws ValueError if messages hold no payload
Payload random_payload(const PayloadCodec& codec, const CounterRng& rng, std::uint64_t index);

}  // namespace fieldmark::watermark
