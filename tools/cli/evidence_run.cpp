#include "cli/evidence_run.h"

#include <fieldmark/imaging/image.h>
#include <fieldmark/watermark/evidence/controls.h>
#include <fieldmark/watermark/evidence/evidence_folder.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <ostream>

#include "cli/cli.h"
#include "cli/context.h"
#include "cli/one_in.h"
#include "cli/rounded_up.h"

namespace fieldmark::cli {
namespace {

using watermark::EvidenceControl;
using watermark::EvidenceImage;
using watermark::EvidenceScore;
constexpr Index kControlViews = 5;
constexpr double kNearMiss = 0.01;  // p-value at or below which images may show a mark that is too faint

float background(const watermark::Owner& owner) { return nerf::background_value(owner.field.background); }

std::string file_name(const std::string& path) { return std::filesystem::path(path).filename().string(); }

// "views/" ends with an empty component.
std::string given_name(const std::string& path) {
  const std::string name = file_name(path);
  return name.empty() ? std::filesystem::path(path).parent_path().filename().string() : name;
}

EvidenceControl built_in(const KeyTest& test, SuspectReader& reader, const watermark::Control& control) {
  const InterruptGuard guard;
  EvidenceControl tested{control.name, control.meaning};
  std::vector<ImageEvidence> read;
  for (const auto& image : control.images) {
    if (guard.interrupted()) throw Interrupted("nothing was decided");
    read.push_back(reader.read(image, control.name + " " + std::to_string(read.size() + 1)));
  }
  tested.images = score_images(test, read);
  tested.together = test(total_evidence(read));
  return tested;
}

Json score_json(const EvidenceScore& s) {
  return {{"statistic", s.statistic},
          {"p_value", s.p_value},
          {"p_value_two_sided", s.p_value_two_sided},
          {"p_value_bits", s.p_value_bits},
          {"matching_bits", s.match.matching}};
}

}  // namespace

std::vector<EvidenceImage> score_images(const KeyTest& test, const std::vector<ImageEvidence>& images) {
  std::vector<EvidenceImage> scores;
  scores.reserve(images.size());
  for (const auto& p : images)
    scores.push_back({file_name(p.image), p.sha256, p.width, p.height, test(p.cells)});
  return scores;
}

TestedControls test_controls(const KeyTest& test, SuspectReader& reader,
                             const std::vector<ImageEvidence>& images, const std::vector<std::string>& given,
                             std::optional<Index> frames, Context& context) {
  TestedControls tested;
  std::vector<Tensor<float>> questioned;
  for (const auto& p : images)
    if (static_cast<Index>(questioned.size()) < kControlViews)
      questioned.push_back(read_again(p, background(test.owner)));
  const auto controls = watermark::built_in_controls(test.owner, questioned, kControlViews, context.seed());
  for (const auto& control : controls) {
    tested.controls.push_back(built_in(test, reader, control));
    tested.thumbnails.push_back(thumbnail(control.images[0]));
  }
  for (const auto& path : given) {
    const auto read =
        read_images(reader, {.paths = {path}, .frames = is_video(path) ? frames : std::nullopt}, {}, context);
    tested.controls.push_back({given_name(path),
                               "Given as a control: images that the user declares unmarked.",
                               score_images(test, read), test(total_evidence(read))});
    tested.thumbnails.push_back(thumbnail(read_again(read[0], background(test.owner))));
  }
  return tested;
}

Json controls_json(const std::vector<EvidenceControl>& controls, double fpr) {
  Json list = Json::array();
  for (const auto& control : controls) {
    Json entry{{"name", control.name}, {"views", control.images.size()}};
    entry.update(score_json(control.together));
    entry["found"] = control.together.p_value <= fpr;
    list.push_back(entry);
  }
  return list;
}

Json per_view_json(const std::vector<ImageEvidence>& images, const std::vector<EvidenceImage>& scores) {
  Json list = Json::array();
  for (std::size_t i = 0; i < scores.size(); ++i) {
    const auto& reading = scores[i].score.reading;
    Json entry{
        {"image", images[i].image}, {"time", number(images[i].time)}, {"bits", to_bits(reading.message)}};
    entry.update(score_json(scores[i].score));
    entry["logits"] = reading.logit;
    entry["bit_p_values"] = watermark::bit_p_values(reading);
    list.push_back(entry);
  }
  return list;
}

void print_views(std::ostream& out, const std::vector<ImageEvidence>& images,
                 const std::vector<EvidenceImage>& scores) {
  for (std::size_t i = 0; i < scores.size(); ++i) {
    const EvidenceScore& s = scores[i].score;
    const auto p_values = watermark::bit_p_values(s.reading);
    char text[120];
    std::snprintf(text, sizeof text, "  %lld of %lld, p %s, weakest bit p %s  ",
                  static_cast<long long>(s.match.matching), static_cast<long long>(s.match.bits),
                  rounded_up(s.p_value).c_str(),
                  rounded_up(*std::max_element(p_values.begin(), p_values.end())).c_str());
    out << to_bits(s.reading.message) << text << images[i].image << "\n";
  }
}

std::string verdict_sentence(double p_value, double fpr) {
  if (p_value <= fpr)
    return "if the key had nothing to do with the images, evidence this strong would occur with a "
           "probability of at most " +
           one_in(p_value);
  const std::string chance =
      "evidence this strong occurs by chance with a probability of up to " + one_in(p_value);
  if (p_value <= kNearMiss)
    return chance + ": it points to a mark of this key, but at most " + exact_rate(fpr) +
           " was required; more images of the field may decide";
  return chance + ": nothing points to a mark of this key, though a damaged one may be left";
}

Json key_counts(const watermark::WrongKeyCounts& found, const std::string& of, Context& context) {
  Json counts = Json::object(), bounds = Json::object(), intervals = Json::object();
  double p = 1;
  for (int i = 0; i < watermark::WrongKeyCounts::kThresholds; ++i) {
    p /= 10;
    const std::string name = "1e-" + std::to_string(i + 1);
    const Index count = found.counts[at(i)], bound = watermark::binomial_upper(found.n, p);
    const auto interval = watermark::binomial_interval(found.n, p);
    counts[name] = count;
    bounds[name] = bound;
    intervals[name] = {interval.low, interval.high};
    char line[160];
    std::snprintf(line, sizeof line,
                  "%s at p <= %s   %lld of %lld, 99%% bound %lld (99%% interval %lld to %lld)\n", of.c_str(),
                  name.c_str(), static_cast<long long>(count), static_cast<long long>(found.n),
                  static_cast<long long>(bound), static_cast<long long>(interval.low),
                  static_cast<long long>(interval.high));
    context.text() << line;
  }
  char least[80];
  std::snprintf(least, sizeof least, "%s, smallest p   %.2e\n", of.c_str(), found.least_p);
  context.text() << least;
  return {{"n", found.n},
          {"counts", counts},
          {"bounds_99", bounds},
          {"intervals_99", intervals},
          {"least_p", found.least_p}};
}

void print_controls(std::ostream& out, const std::vector<EvidenceControl>& controls, double fpr) {
  for (const auto& control : controls) {
    const EvidenceScore& s = control.together;
    char text[160];
    std::snprintf(text, sizeof text, "%s (two-sided %s), %lld of %lld match, images: %zu%s\n",
                  rounded_up(s.p_value).c_str(), rounded_up(s.p_value_two_sided).c_str(),
                  static_cast<long long>(s.match.matching), static_cast<long long>(s.match.bits),
                  control.images.size(), s.p_value <= fpr ? ": THE TEST RESPONDS TO A CONTROL" : "");
    out << "control " << control.name << ": p " << text;
  }
}

void write_evidence(const std::string& folder, const watermark::EvidenceRecord& record,
                    const std::vector<ImageEvidence>& images, const std::vector<std::string>& controls,
                    const watermark::Owner& owner, const watermark::Key& key) {
  PageImages small{.controls = controls};
  for (const auto& image : images) small.images.push_back(thumbnail(read_again(image, background(owner))));
  const std::string page = evidence_page(record, watermark::public_key(key), small);
  watermark::write_evidence_folder(folder, record, page, key);
}

}  // namespace fieldmark::cli
