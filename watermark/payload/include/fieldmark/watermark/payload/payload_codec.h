#pragma once
#include <fieldmark/watermark/payload/bch.h>
#include <fieldmark/watermark/payload/message.h>
#include <fieldmark/watermark/payload/ordered_statistics.h>
#include <fieldmark/watermark/payload/payload.h>

#include <optional>
#include <span>
#include <vector>

namespace fieldmark::watermark {

/// Layout of a message with up to `data_bits` of data: version, data and zeros, then check bits, then spare
/// bits.
struct PayloadLayout {
  Index data_bits = 0;   ///< 16, 24, 32, 40, 64 or 128
  Index check_bits = 0;  ///< of the BCH code
  Index zero_bits = 0;   ///< unused information bits: 0, protected by the code
  Index spare_bits = 0;  ///< bits after the codeword: 0, not protected by the code
  /// Number of wrong bits that are always accepted, at least 1; fewer than the code corrects where
  /// kMostChance requires it.
  Index corrects = 0;
  /// Probability that random bits decode to a payload of this layout:
  ///   payloads * sum_(i <= corrects) C(n, i) / 2^n,   n bits in a codeword
  /// Exact, since the spheres around codewords are disjoint.
  double chance = 0;
};

/// A decoded payload.
struct PayloadReading {
  Payload payload;      ///< hex keeps the leading zeros of its layout
  Index corrected = 0;  ///< bits in which reading and message differ
  /// Bound on the probability that random signs on the same magnitudes agree as well with any payload of the
  /// layout.
  double chance = 1;
};

/// Encodes payloads in messages of a given length. A version of four bits tells kind and length of the data,
/// so a reader needs no options:
///   1 to 6: hex, 7 to 12: text, of 16, 24, 32, 40, 64 or 128 bits;  13: uuid;  0, 14 and 15 are reserved
/// Version and data are protected by the strongest BCH code over GF(2^4) to GF(2^8).
class PayloadCodec {
 public:
  /// Largest PayloadLayout::chance; layouts that then correct no bit are left out.
  static constexpr double kMostChance = 1e-3;
  /// Largest PayloadReading::chance accepted for a reading with more wrong bits than its layout corrects.
  static constexpr double kMostSoftChance = 1e-4;

  /// @param raw_bits  length of a message, 1 to 256   @throws ValueError otherwise
  explicit PayloadCodec(Index raw_bits);

  /// Length of a message.
  Index raw_bits() const { return raw_bits_; }
  /// Returns all layouts from the shortest data to the longest; none if messages are too short.
  std::vector<PayloadLayout> layouts() const;
  /// Bounds the probability that fair bits of any magnitudes decode to a payload: the sum over layouts of
  /// their chance and kMostSoftChance.
  double chance() const;

  /// Encodes a payload in the layout with the shortest data that hold it.
  /// @throws ValueError if it does not fit
  Message encode(const Payload& payload) const;
  /// Decodes what encode() returns; nothing if the message encodes no payload. Hex keeps its leading zeros.
  /// @throws ValueError for a message of another length
  std::optional<Payload> payload(const Message& message) const;
  /// Decodes a reading by Bch::decode() and OrderedStatistics and keeps the payload that agrees best. It is
  /// accepted if at most PayloadLayout::corrects bits of its codeword are wrong (undecided bits count as
  /// wrong), or if its chance is at most kMostSoftChance.
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

/// Bounds the probability that random signs agree with one message as well as a reading does.
///   P(sum_i +-|logit_i| >= agreement) <= min_(x >= 0) prod_i cosh(x logit_i) / exp(x agreement)
/// Source: Chernoff 1952.   @param agreement  sum_i logit_i (2 bit_i - 1)   @return its logarithm, at most 0
double log_chance_of_agreement(std::span<const double> logit, double agreement);

}  // namespace fieldmark::watermark
