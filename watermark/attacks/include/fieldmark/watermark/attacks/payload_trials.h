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

/// The same from the evidence of views, added up over groups of successive ones.
class PayloadViews {
 public:
  /// @param code  of the owner, must outlive this   @param raw_bits  length of a message, 1 to 256
  /// @param together  views of a group, at least 1; views of a group must have the same message
  /// @throws ValueError if a number is out of range
  PayloadViews(const CellCode& code, Index raw_bits, Index together);
  /// Groups refer to what is in here.
  PayloadViews(const PayloadViews&) = delete;
  /// One image, views in their order under each name; a message that is no payload is passed over.
  /// @param evidence  [cells]   @throws ValueError as read_bits()
  void add(Index view, const std::string& under, std::span<const double> evidence, const Message& sent);
  /// Of whole groups, by the name they were added under.
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

/// Bits of random_payload(): the longest data up to 40 that the codec's messages hold; 0 if they hold none.
Index random_payload_bits(const PayloadCodec& codec);
/// Random hexadecimal payload for measuring, a function of (rng, index).   @throws ValueError if they hold
/// none
Payload random_payload(const PayloadCodec& codec, const CounterRng& rng, std::uint64_t index);

}  // namespace fieldmark::watermark
