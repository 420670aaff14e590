#include <fieldmark/core/error.h>
#include <fieldmark/watermark/payload/payload_codec.h>

#include <algorithm>
#include <cmath>
#include <string>

namespace fieldmark::watermark {
namespace {

using Bits = std::vector<std::uint8_t>;

constexpr Index kMostRawBits = 256, kVersionBits = 4, kDataBits[] = {16, 24, 32, 40, 64, 128};
constexpr unsigned kHexVersion = 1, kTextVersion = 7, kUuidVersion = 13;
constexpr int kLeastField = 4, kMostField = 8;

// Returns the share of the words of n bits within a Hamming radius of one word.
double sphere(Index n, Index radius) {
  double sum = 0, term = std::ldexp(1.0, static_cast<int>(-n));
  for (Index i = 0; i <= radius; ++i) {
    sum += term;
    term *= static_cast<double>(n - i) / static_cast<double>(i + 1);
  }
  return sum;
}

// Returns the largest radius, at most the code's, that keeps kMostChance.
Index radius_of(const Bch& code, double payloads) {
  Index radius = code.corrects();
  while (radius > 0 && payloads * sphere(code.length(), radius) > PayloadCodec::kMostChance) --radius;
  return radius;
}

Bits information_of(unsigned version, std::span<const std::uint8_t> data, Index dimension) {
  Bits bits;
  for (Index i = kVersionBits - 1; i >= 0; --i) bits.push_back(static_cast<std::uint8_t>((version >> i) & 1));
  bits.insert(bits.end(), data.begin(), data.end());
  bits.resize(static_cast<std::size_t>(dimension), 0);
  return bits;
}

// Returns the words of version 0 with one data bit each.
std::vector<Bits> data_words(const Bch& bch, Index data_bits) {
  std::vector<Bits> words;
  for (Index i = 0; i < data_bits; ++i) {
    Bits data(static_cast<std::size_t>(data_bits), 0);
    data[static_cast<std::size_t>(i)] = 1;
    words.push_back(bch.encode(information_of(0, data, bch.dimension())));
  }
  return words;
}

void check_size(const char* op, Index size, Index raw_bits) {
  if (size != raw_bits)
    throw ValueError("[" + std::string(op) + "] must have " + std::to_string(raw_bits) + " bits, got " +
                     std::to_string(size));
}

}  // namespace

std::optional<PayloadCodec::Code> PayloadCodec::make_code(Index raw_bits, Index data_bits) {
  std::vector<Version> versions;
  for (unsigned i = 0; i < std::size(kDataBits); ++i)
    if (kDataBits[i] == data_bits)
      versions = {{kHexVersion + i, PayloadKind::hex}, {kTextVersion + i, PayloadKind::text}};
  if (payload_count(PayloadKind::uuid, data_bits) > 0) versions.push_back({kUuidVersion, PayloadKind::uuid});
  double payloads = 0;
  for (const Version& v : versions) payloads += payload_count(v.kind, data_bits);
  // A code over a smaller field may correct more, although it leaves bits unused.
  std::optional<Bch> best;
  for (int m = kMostField; m >= kLeastField; --m) {
    const Index length = std::min(raw_bits, (Index{1} << m) - 1);
    const auto code = Bch::strongest(m, length, kVersionBits + data_bits);
    if (code && (!best || radius_of(*code, payloads) > radius_of(*best, payloads))) best = code;
  }
  if (!best || radius_of(*best, payloads) == 0) return std::nullopt;
  const Index radius = radius_of(*best, payloads);
  Code code{.layout = {.data_bits = data_bits,
                       .check_bits = best->check_bits(),
                       .zero_bits = best->dimension() - kVersionBits - data_bits,
                       .spare_bits = raw_bits - best->length(),
                       .corrects = radius,
                       .chance = payloads * sphere(best->length(), radius)},
            .payloads = payloads,
            .bch = *best,
            .data = OrderedStatistics(data_words(*best, data_bits)),
            .versions = versions,
            .offsets = {}};
  for (const Version& v : versions)
    code.offsets.push_back(best->encode(information_of(v.number, {}, best->dimension())));
  return code;
}

PayloadCodec::PayloadCodec(Index raw_bits) : raw_bits_(raw_bits) {
  if (raw_bits < 1 || raw_bits > kMostRawBits)
    throw ValueError("[PayloadCodec] raw_bits must be 1 to 256, got " + std::to_string(raw_bits));
  for (Index data_bits : kDataBits)
    if (auto code = make_code(raw_bits, data_bits)) codes_.push_back(std::move(*code));
}

std::vector<PayloadLayout> PayloadCodec::layouts() const {
  std::vector<PayloadLayout> layouts;
  for (const Code& code : codes_) layouts.push_back(code.layout);
  return layouts;
}

double PayloadCodec::chance() const {
  double sum = 0;
  for (const Code& code : codes_) sum += code.layout.chance + kMostSoftChance;
  return sum;
}

Message PayloadCodec::encode(const Payload& payload) const {
  const Payload checked = parse_payload(payload.kind, payload.value);
  const Index bits = payload_bits(checked);
  for (const Code& code : codes_) {
    if (code.layout.data_bits < bits) continue;
    const auto version = std::find_if(code.versions.begin(), code.versions.end(),
                                      [&](const Version& v) { return v.kind == checked.kind; });
    if (version == code.versions.end()) continue;
    Message message{code.bch.encode(
        information_of(version->number, payload_data(checked, code.layout.data_bits), code.bch.dimension()))};
    message.bits.resize(static_cast<std::size_t>(raw_bits_), 0);
    return message;
  }
  const std::string most =
      codes_.empty() ? "no payload" : "at most " + std::to_string(codes_.back().layout.data_bits);
  Index needed = raw_bits_ + 1;  // the shortest message that holds the payload
  const auto holds = [&](Index data_bits) {
    return data_bits >= bits && payload_count(checked.kind, data_bits) > 0 && make_code(needed, data_bits);
  };
  while (needed <= kMostRawBits && std::ranges::none_of(kDataBits, holds)) ++needed;
  throw ValueError(
      "[PayloadCodec::encode] payload: has " + std::to_string(bits) + " bits, a message of " +
      std::to_string(raw_bits_) + " bits can hold " + most + "; it needs a message of " +
      (needed <= kMostRawBits ? std::to_string(needed) + " bits" : "more than 256 bits, which there is not"));
}

std::optional<Payload> PayloadCodec::payload_of(const Code& code, std::span<const std::uint8_t> codeword) {
  unsigned number = 0;
  for (std::size_t i = 0; i < kVersionBits; ++i) number = 2 * number + codeword[i];
  const auto data_begin = static_cast<std::size_t>(kVersionBits),
             data_bits = static_cast<std::size_t>(code.layout.data_bits);
  const auto zeros =
      codeword.subspan(data_begin + data_bits, static_cast<std::size_t>(code.layout.zero_bits));
  if (std::any_of(zeros.begin(), zeros.end(), [](auto bit) { return bit != 0; })) return std::nullopt;
  for (const Version& v : code.versions)
    if (v.number == number) return payload_from_data(v.kind, codeword.subspan(data_begin, data_bits));
  return std::nullopt;
}

std::optional<Payload> PayloadCodec::payload(const Message& message) const {
  check_size("PayloadCodec::payload", message.size(), raw_bits_);
  for (const Code& code : codes_) {
    auto found = payload_of(code, message.bits);
    if (found && encode(*found) == message) return found;
  }
  return std::nullopt;
}

// Returns the candidate codewords of a reading.
std::vector<Bits> PayloadCodec::candidates(const Code& code, std::span<const double> logit) const {
  std::vector<Bits> words;
  const auto used = logit.first(static_cast<std::size_t>(code.bch.length()));
  Bits signs;
  for (double x : used) signs.push_back(x > 0);
  if (auto word = code.bch.decode(signs)) words.push_back(std::move(word->bits));
  // Relative to each version's offset, the data words form a linear code.
  const int order = code.layout.data_bits <= 40 ? 3 : 2;
  for (const Bits& offset : code.offsets) {
    std::vector<double> turned(used.begin(), used.end());
    for (std::size_t i = 0; i < turned.size(); ++i)
      if (offset[i] != 0) turned[i] = -turned[i];
    Bits word = code.data.nearest(turned, order);
    for (std::size_t i = 0; i < word.size(); ++i) word[i] ^= offset[i];
    words.push_back(std::move(word));
  }
  return words;
}

std::optional<PayloadReading> PayloadCodec::read(std::span<const double> logit) const {
  check_size("PayloadCodec::read", static_cast<Index>(logit.size()), raw_bits_);
  if (!std::all_of(logit.begin(), logit.end(), [](double x) { return std::isfinite(x); }))
    throw ValueError("[PayloadCodec::read] logits must be finite");
  std::optional<PayloadReading> best;
  double most = 0;
  for (const Code& code : codes_) {
    for (Bits& word : candidates(code, logit)) {
      const auto payload = payload_of(code, word);
      if (!payload) continue;
      const std::size_t length = word.size();
      word.resize(logit.size(), 0);
      double agreement = 0;
      Index corrected = 0, wrong = 0;
      for (std::size_t i = 0; i < word.size(); ++i) {
        agreement += word[i] != 0 ? logit[i] : -logit[i];
        corrected += (logit[i] > 0) != (word[i] != 0);
        wrong += i < length && (logit[i] == 0 || (logit[i] > 0) != (word[i] != 0));
      }
      if (best && agreement <= most) continue;
      const double chance =
          std::min(1.0, code.payloads * std::exp(log_chance_of_agreement(logit, agreement)));
      if (wrong > code.layout.corrects && chance > kMostSoftChance) continue;
      most = agreement;
      best = PayloadReading{*payload, corrected, chance};
    }
  }
  // The best of all layouts is reported.
  if (best) best->chance = std::min(1.0, best->chance * static_cast<double>(codes_.size()));
  return best;
}

double log_chance_of_agreement(std::span<const double> logit, double agreement) {
  double largest = 0;
  for (double x : logit) largest = std::max(largest, std::abs(x));
  if (largest == 0 || agreement <= 0) return 0;
  // The slope sum_i |l_i| tanh(x |l_i|) - agreement rises with x. Any x gives a bound, so a few digits
  // suffice.
  double low = std::log(1e-6 / largest), high = std::log(1e4 / largest);
  for (int step = 0; step < 40; ++step) {
    const double middle = (low + high) / 2, x = std::exp(middle);
    double slope = -agreement;
    for (double l : logit) slope += std::abs(l) * std::tanh(x * std::abs(l));
    (slope < 0 ? low : high) = middle;
  }
  const double x = std::exp(low);
  double sum = -x * agreement;
  for (double l : logit) {
    const double y = x * std::abs(l);
    sum += y + std::log1p(std::exp(-2 * y)) - std::log(2.0);
  }
  return std::min(sum, 0.0);
}

}  // namespace fieldmark::watermark
