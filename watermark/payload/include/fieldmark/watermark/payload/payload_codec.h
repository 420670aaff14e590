#pragma once
#include <fieldmark/watermark/payload/bch.h>
#include <fieldmark/watermark/payload/message.h>
#include <fieldmark/watermark/payload/ordered_statistics.h>
#include <fieldmark/watermark/payload/payload.h>

#include <optional>
#include <span>
#include <vector>

namespace fieldmark::watermark {

/// How payloads of up to so many bits lie in a message: version, data and zeros, then check bits, then spare
/// bits.
struct PayloadLayout {
  Index data_bits = 0;   ///< 16, 24, 32, 40, 64 or 128
  Index check_bits = 0;  ///< of the BCH code
  Index zero_bits = 0;   ///< information bits that are left over: 0, and checked
  Index spare_bits = 0;  ///< of the message behind the codeword: 0, and not checked
  Index corrects = 0;  ///< wrong bits of a codeword that are accepted wherever they are, at least 1: the code
                       ///< may be able to correct more, but not at kMostChance
  double chance =
      0;  ///< that random bits lie so near to a payload of this layout: payloads * sum_(i <= corrects)
          ///< C(n, i) / 2^n, n bits in a codeword; exact, since such spheres do not meet
};

/// A payload that was read.
struct PayloadReading {
  Payload payload;      ///< a hex one with the zeros before it that its layout has room for
  Index corrected = 0;  ///< bits of the reading that its message has otherwise
  /// Bound on the probability that random signs on the same strengths agree as well with any payload of the
  /// layout.
  double chance = 1;
};

/// Payloads in messages of a given length. The first four bits of a message are a version that tells kind and
/// length of the data, so that a reader needs no options:
///   1 to 6: hex, 7 to 12: text, of 16, 24, 32, 40, 64 or 128 bits;  13: uuid;  0, 14 and 15 stand for
///   nothing
/// They are followed by the data, and both are kept by the BCH code over the field GF(2^4) to GF(2^8) that
/// corrects most.
class PayloadCodec {
 public:
  /// Most that a layout's chance may be; a layout that cannot correct one bit so is left out.
  static constexpr double kMostChance = 1e-3;
  /// Most that PayloadReading::chance may be where more bits are wrong than a layout corrects.
  static constexpr double kMostSoftChance = 1e-4;

  /// @param raw_bits  length of a message, 1 to 256   @throws ValueError otherwise
  explicit PayloadCodec(Index raw_bits);

  /// Length of a message.
  Index raw_bits() const { return raw_bits_; }
  /// From the shortest data to the longest; none where messages are too short.
  std::vector<PayloadLayout> layouts() const;
  /// Bound on the probability that fair bits of any strengths are read as some payload: the sum over layouts
  /// of their chance and kMostSoftChance.
  double chance() const;

  /// The message of a payload, by the layout of the shortest data that holds it.
  /// @throws ValueError if it does not fit
  Message encode(const Payload& payload) const;
  /// The payload that encode() makes this message of; nothing if none does. Hex comes with zeros before it.
  /// @throws ValueError for a message of another length
  std::optional<Payload> payload(const Message& message) const;
  /// The payload that a reading tells, if any: of those found by Bch::decode and by OrderedStatistics, the
  /// one that agrees best, provided that at most PayloadLayout::corrects bits of its codeword are wrong, one
  /// without evidence counting as wrong, or that its chance is at most kMostSoftChance.
  /// @param logit  [raw_bits] finite, of any scale, see BitReading::sum   @throws ValueError otherwise
  std::optional<PayloadReading> read(std::span<const double> logit) const;

 private:
  struct Version {
    unsigned number;
    PayloadKind kind;
  };
  struct Code {
    PayloadLayout layout;
    double payloads;
    Bch bch;
    OrderedStatistics data;                          // codewords of version 0
    std::vector<Version> versions;                   // of this number of data bits
    std::vector<std::vector<std::uint8_t>> offsets;  // codewords of each version without data
  };
  static std::optional<Code> make_code(Index raw_bits, Index data_bits);
  static std::optional<Payload> payload_of(const Code& code, std::span<const std::uint8_t> codeword);
  std::vector<std::vector<std::uint8_t>> candidates(const Code& code, std::span<const double> logit) const;

  Index raw_bits_;
  std::vector<Code> codes_;
};

/// Bound on the probability that random signs agree with one message as well as a reading does.
///   P(sum_i +-|logit_i| >= agreement) <= min_(x >= 0) prod_i cosh(x logit_i) / exp(x agreement)
/// Source: Chernoff 1952.   @param agreement  sum_i logit_i (2 bit_i - 1)   @return its logarithm, at most 0
double log_chance_of_agreement(std::span<const double> logit, double agreement);

}  // namespace fieldmark::watermark
