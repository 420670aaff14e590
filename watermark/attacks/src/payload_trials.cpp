#include <fieldmark/core/error.h>
#include <fieldmark/watermark/attacks/payload_trials.h>
#include <fieldmark/watermark/evidence/evidence.h>

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
  // At the ends, rounding would leave a small remainder.
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

PayloadViews::PayloadViews(const CellCode& code, Index raw_bits, Index together)
    : code_(&code), codec_(raw_bits), together_(together) {
  if (together < 1)
    throw ValueError("[PayloadViews] together must be at least 1, got " + std::to_string(together));
}

void PayloadViews::add(Index view, const std::string& under, std::span<const double> evidence,
                       const Message& sent) {
  const auto payload = codec_.payload(sent);
  if (!payload) return;
  Group& group = groups_.try_emplace(under, Group{{}, PayloadTrials(codec_)}).first->second;
  if (view % together_ == 0) group.evidence.assign(evidence.size(), 0.0);
  for (std::size_t c = 0; c < group.evidence.size(); ++c) group.evidence[c] += evidence[c];
  if (view % together_ == together_ - 1)
    group.trials.add(read_bits(group.evidence, *code_, codec_.raw_bits()).sum, *payload);
}

std::map<std::string, PayloadAccuracy> PayloadViews::accuracies() const {
  std::map<std::string, PayloadAccuracy> all;
  for (const auto& [name, group] : groups_) all[name] = group.trials.accuracy();
  return all;
}

Index random_payload_bits(const PayloadCodec& codec) {
  Index bits = 0;
  for (const PayloadLayout& layout : codec.layouts())
    if (layout.data_bits <= 40) bits = layout.data_bits;
  return bits;
}

Payload random_payload(const PayloadCodec& codec, const CounterRng& rng, std::uint64_t index) {
  const Index bits = random_payload_bits(codec);
  if (bits == 0)
    throw ValueError("[random_payload] codec: messages of " + std::to_string(codec.raw_bits()) +
                     " bits hold no payload");
  return {PayloadKind::hex, to_hex(random_message(bits, rng, index))};
}

}  // namespace fieldmark::watermark
