#include <fieldmark/core/error.h>
#include <fieldmark/watermark/evidence/evidence_record.h>
#include "canonical_json.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

namespace fieldmark::watermark {
namespace {

using Json = nlohmann::json;
constexpr char kFormat[] = "fieldmark evidence 1";
// Signed records keep the JSON keys of version 0.1, so that old evidence remains valid.
constexpr char kCommitment[] = "claim", kImages[] = "pictures";

Json score_json(const EvidenceScore& s) {
  std::vector<double> confidences;  // the format's name for 1 - p of each bit
  for (const double p : bit_p_values(s.reading)) confidences.push_back(1 - p);
  return {{"statistic", s.statistic},
          {"p_value", s.p_value},
          {"p_value_two_sided", s.p_value_two_sided},
          {"p_value_bits", s.p_value_bits},
          {"p_value_bits_two_sided", s.p_value_bits_two_sided},
          {"matching_bits", s.match.matching},
          {"decided_bits", s.match.decided},
          {"bits", to_bits(s.reading.message)},
          {"logits", s.reading.logit},
          {"confidences", confidences}};
}

Json images_json(const std::vector<EvidenceImage>& images) {
  Json list = Json::array();
  for (const auto& image : images) {
    Json entry = score_json(image.score);
    entry["name"] = image.name;
    entry["sha256"] = image.sha256;
    entry["width"] = image.width;
    entry["height"] = image.height;
    list.push_back(entry);
  }
  return list;
}

Json controls_json(const std::vector<EvidenceControl>& controls) {
  Json list = Json::array();
  for (const auto& control : controls)
    list.push_back({{"name", control.name},
                    {"meaning", control.meaning},
                    {kImages, images_json(control.images)},
                    {"together", score_json(control.together)}});
  return list;
}

Json wrong_keys_json(const WrongKeyCounts& found) {
  Json counts = Json::object(), intervals = Json::object();
  for (int i = 0; i < WrongKeyCounts::kThresholds; ++i) {
    const std::string name = "1e-" + std::to_string(i + 1);
    const auto interval = binomial_interval(found.n, std::pow(10., -1 - i));
    counts[name] = found.counts[static_cast<std::size_t>(i)];
    intervals[name] = {interval.low, interval.high};
  }
  return {{"n", found.n},
          {"counts", counts},
          {"intervals_99", intervals},
          {"least_p", found.least_p},
          {"histogram", found.histogram},
          {"histogram_from", -WrongKeyCounts::kBins / 2 / WrongKeyCounts::kBinsPerUnit},
          {"histogram_bins_per_unit", WrongKeyCounts::kBinsPerUnit}};
}

[[noreturn]] void refuse(std::string_view name, const std::string& what) {
  throw IoError(std::string(name) + ": " + what);
}

bool is_near(double a, double b) { return std::abs(a - b) <= 1e-5 * std::abs(b); }

// get<Index>() would truncate fractions and wrap large numbers.
Index whole_number(const Json& j, std::string_view name) {
  constexpr Index kMost = 1 << 30;
  if (!j.is_number_unsigned() || j.get<std::uint64_t>() > kMost)
    refuse(name, "expected a whole number from 0 to " + std::to_string(kMost) + ", found " + j.dump());
  return j.get<Index>();
}

// With ten digits of T, T^2 / 2 has an error of 5e-10 T^2, at most 2e-6 since T^2 is below the number of
// cells.
void check_score(const Json& j, const Message& message, std::string_view name) {
  const double t = j.at("statistic").get<double>();
  const std::string bits = j.at("bits").get<std::string>();
  const Index matching = whole_number(j.at("matching_bits"), name),
              decided = whole_number(j.at("decided_bits"), name);
  if (bits.size() != message.bits.size() || decided > message.size())
    refuse(name, "expected as many bits as the message has");
  const std::string wanted = to_bits(message);
  Index agree = 0;
  for (std::size_t i = 0; i < bits.size(); ++i) agree += bits[i] == wanted[i];
  // Undecided bits are written as 0 and do not count.
  if (matching > agree || matching < agree - (message.size() - decided) || matching > decided)
    refuse(name, "the number of matching bits does not follow from the bits");
  const auto fits = [&](const char* key, double expected) {
    if (!is_near(j.at(key).get<double>(), expected))
      refuse(name, std::string(key) + " does not follow from the other figures");
  };
  fits("p_value", keyed_p_value(t));
  fits("p_value_two_sided", keyed_p_value_two_sided(t));
  fits("p_value_bits", p_value_bits(matching, decided));
  fits("p_value_bits_two_sided", p_value_bits_two_sided(matching, decided));
}

std::vector<EvidenceSummary::Image> checked_images(const Json& list, const Message& message,
                                                   std::string_view name) {
  std::vector<EvidenceSummary::Image> images;
  for (const Json& entry : list) {
    check_score(entry, message, name);
    images.push_back({entry.at("name").get<std::string>(), entry.at("sha256").get<std::string>()});
  }
  return images;
}

EvidenceSummary summary(const Json& j, std::string_view name) {
  if (j.at("format") != kFormat) refuse(name, std::string("expected the format \"") + kFormat + "\"");
  EvidenceSummary s;
  s.signer = public_key_from_hex(j.at("public_key").get<std::string>());
  s.owner_sha256 = j.at("owner_sha256").get<std::string>();
  s.commitment = j.at(kCommitment).get<std::string>();
  s.message = message_from_hex(j.at("message").get<std::string>(), whole_number(j.at("message_bits"), name));
  s.copy = j.value("copy", "");
  s.key_free = j.value("key_free", true);
  s.found = j.at("found").get<bool>();
  s.fpr = j.at("fpr").get<double>();
  s.files = j.at("files").get<std::map<std::string, std::string>>();
  check_score(j.at("together"), s.message, name);
  s.p_value = j.at("together").at("p_value").get<double>();
  if (s.found != (s.p_value <= s.fpr) && !is_near(s.p_value, s.fpr))
    refuse(name, "the decision does not follow from the p-value");
  s.images = checked_images(j.at(kImages), s.message, name);
  for (const Json& control : j.at("controls")) {
    check_score(control.at("together"), s.message, name);
    const auto more = checked_images(control.at(kImages), s.message, name);
    s.controls.insert(s.controls.end(), more.begin(), more.end());
  }
  return s;
}

}  // namespace

std::string evidence_json(const EvidenceRecord& record, const PublicKey& signer,
                          const std::map<std::string, std::string>& files) {
  Json json{{"format", kFormat},
            {"public_key", to_hex(signer)},
            {"owner_sha256", record.owner_sha256},
            {kCommitment, record.commitment},
            {"message", to_hex(record.message)},
            {"message_bits", record.message.size()},
            {"reading", record.reading},
            {"found", record.found()},
            {"fpr", record.fpr},
            {"cells", record.cells},
            {"together", score_json(record.together)},
            {kImages, images_json(record.images)},
            {"controls", controls_json(record.controls)},
            {"wrong_keys", record.wrong_keys ? wrong_keys_json(*record.wrong_keys) : Json(nullptr)},
            {"seed", record.seed},
            {"commit", record.commit},
            {"isa", record.isa},
            {"files", files}};
  if (!record.copy.empty()) json["copy"] = record.copy;
  if (!record.key_free) json["key_free"] = false;
  return canonical_json(json.dump(-1, ' ', false, Json::error_handler_t::replace), "evidence");
}

EvidenceSummary parse_evidence(std::string_view text, std::string_view name) {
  if (canonical_json(text, name) != text) refuse(name, "expected the canonical form that was signed");
  try {
    return summary(Json::parse(text), name);
  } catch (const Json::exception& e) {
    refuse(name, std::string("expected evidence: ") + e.what());
  } catch (const ValueError& e) {
    refuse(name, std::string("expected evidence: ") + e.what());
  }
}

}  // namespace fieldmark::watermark
