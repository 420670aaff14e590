#include "cli/evidence_page.h"
#include "cli/one_in.h"
#include "cli/rounded_up.h"

#include <fieldmark/core/base64.h>
#include <fieldmark/imaging/bar_chart.h>
#include <fieldmark/imaging/histogram_chart.h>
#include <fieldmark/imaging/image.h>
#include <fieldmark/imaging/markup.h>
#include <fieldmark/imaging/resize.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace fieldmark::cli {
namespace {

using bench::escaped_markup;
using watermark::EvidenceRecord;
using watermark::EvidenceScore;
constexpr Index kThumbnail = 160;           // pixels of the longer side
constexpr int kQuality = 80;                // of its JPEG
constexpr std::size_t kPlottedImages = 40;  // more would not fit on a page

constexpr char kHead[] = R"(<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; img-src data:; style-src 'unsafe-inline'">
<title>Evidence of a mark</title>
<style>
body { font: 16px/1.5 sans-serif; color: #1a1a1a; background: #fff; max-width: 960px; margin: 2em auto; padding: 0 1em; }
h1 { font-size: 1.6em; } h2 { font-size: 1.2em; margin-top: 2em; border-bottom: 1px solid #bbb; }
.verdict { border: 3px solid; padding: 0.6em 1em; font-size: 1.1em; }
.found { border-color: #1b5e20; } .missing { border-color: #8c2a20; }
table { border-collapse: collapse; margin: 1em 0; width: 100%; }
caption { text-align: left; font-weight: bold; padding: 0.3em 0; }
th, td { border: 1px solid #bbb; padding: 0.3em 0.5em; text-align: left; vertical-align: top; }
thead th { background: #eee; } td.n { text-align: right; white-space: nowrap; }
code { font-size: 0.9em; overflow-wrap: anywhere; } u { text-decoration-thickness: 2px; }
figure { margin: 1em 0; } figure svg { max-width: 100%; height: auto; }
img { display: block; max-width: 160px; height: auto; }
@media print { body { margin: 0; max-width: none; } tr, figure { break-inside: avoid; } }
</style>
</head>
<body>
)";

std::string text_of(double value, const char* format = "%.2g") {
  char text[40];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

std::string cell(const std::string& inner) { return "<td>" + inner + "</td>"; }
std::string number_cell(const std::string& inner) { return "<td class=\"n\">" + inner + "</td>"; }
std::string code(const std::string& text) { return "<code>" + escaped_markup(text) + "</code>"; }

// Underlines the bits that differ from the message.
std::string marked_bits(const EvidenceScore& score, const watermark::Message& message) {
  std::string out;
  for (std::size_t i = 0; i < message.bits.size(); ++i) {
    const bool bit = score.reading.message.bits[i];
    const std::string digit = !score.reading.decided[i] ? "-" : bit ? "1" : "0";
    out += digit != "-" && bit == (message.bits[i] == 1) ? digit : "<u>" + digit + "</u>";
  }
  return "<code>" + out + "</code>";
}

std::string score_cells(const EvidenceScore& s) {
  return number_cell(std::to_string(s.match.matching) + " of " + std::to_string(s.match.bits)) +
         number_cell(rounded_up(s.p_value)) + number_cell(rounded_up(s.p_value_two_sided)) +
         number_cell(rounded_up(s.p_value_bits));
}

std::string verdict(const EvidenceRecord& r) {
  const std::string count =
      r.images.size() == 1 ? "the image" : "the " + std::to_string(r.images.size()) + " images together";
  if (r.found())
    return "<p class=\"verdict found\"><strong>The mark was found</strong> in " + count +
           ". If the owner's key had nothing to do with them, evidence this strong would occur with a "
           "probability of at most " +
           one_in(r.together.p_value, NumberStyle::html) +
           " (required: " + exact_rate(r.fpr, NumberStyle::html) + ").</p>\n";
  return "<p class=\"verdict missing\"><strong>The mark was not found</strong> in " + count +
         ". Evidence this strong occurs by chance with a probability of up to " +
         one_in(r.together.p_value, NumberStyle::html) + "; at most " + exact_rate(r.fpr, NumberStyle::html) +
         " was required.</p>\n";
}

// Says what the verdict does not cover in this record.
std::string reservations(const EvidenceRecord& r) {
  std::string out;
  if (!r.key_free)
    out +=
        "<p><strong>The bound is not proven for this owner file:</strong> its networks were trained under "
        "its own key (version 0.1).</p>\n";
  if (r.found())
    if (const Index against = watermark::contradicting_bits(r.together.reading, r.message); against > 0)
      out += "<p><strong>Bits that contradict the message: " + std::to_string(against) +
             ".</strong> The images may carry another message of this key.</p>\n";
  if (!r.copy.empty())
    out += "<p>This test is of the copy of one recipient, " + escaped_markup(r.copy) +
           ". If several names were tried, multiply the p-value by their number; the list of names must be "
           "older than the test.</p>\n";
  return out;
}

std::string controls_verdict(const EvidenceRecord& r) {
  std::string loud;
  for (const auto& control : r.controls)
    if (control.together.p_value <= r.fpr) loud += (loud.empty() ? "" : ", ") + escaped_markup(control.name);
  if (r.controls.empty()) return "<p>No controls were tested.</p>\n";
  if (loud.empty())
    return "<p>The same test found nothing in any control, that is, in images without the mark.</p>\n";
  return "<p><strong>The test also responded to controls: " + loud +
         ".</strong> Either they hold the mark, or the test is not reliable here.</p>\n";
}

constexpr char kLimits[] = R"(<h2>What this does not prove</h2>
<ul>
<li><strong>It counts only if the commitment below was published or time-stamped before the field and its images were
published.</strong> Afterwards anybody can make up a mark that fits given images.</li>
<li>It says that the images carry this owner's mark. It does not say who made them, who copied from whom, or who holds which rights.</li>
<li>It counts only if the message was known before the images were read: a message read from the images fits them.</li>
<li>The probabilities hold for images, and a kind of detection, that were not selected by their result. One of a thousand tests reaches 0.001 by chance.</li>
<li>A mark that was not found may still have been there: a mark can be damaged.</li>
<li>A p-value is not the probability that the mark is absent. It is a bound on how often a random key gives evidence this strong.</li>
<li>The signature shows that the holder of the key wrote these figures and that nobody changed them since. It does not show that
they were computed honestly. Whoever holds the OWNER file can repeat the test.</li>
</ul>
)";

std::string row(const char* what, const std::string& value) {
  return std::string("<tr><th scope=\"row\">") + what + "</th>" + cell(value) + "</tr>\n";
}

std::string figures(const EvidenceRecord& r) {
  const EvidenceScore& s = r.together;
  return "<h2>Figures</h2>\n<table><caption>All images together</caption>\n" +
         row("Message looked for",
             code(to_hex(r.message)) + ", " + std::to_string(r.message.size()) + " bits") +
         row("Bits read; those that differ are underlined", marked_bits(s, r.message)) +
         row("p-value of the key", rounded_up(s.p_value) + " one-sided, " + rounded_up(s.p_value_two_sided) +
                                       " two-sided; a bound for any image, over " + std::to_string(r.cells) +
                                       " cells of the scene, T = " + text_of(s.statistic, "%.2f")) +
         row("p-value of the matching bits", rounded_up(s.p_value_bits) + " one-sided, " +
                                                 rounded_up(s.p_value_bits_two_sided) + " two-sided; " +
                                                 std::to_string(s.match.matching) + " of " +
                                                 std::to_string(s.match.decided) + " decided bits match") +
         (r.copy.empty() ? "" : row("Recipient of the copy", escaped_markup(r.copy))) +
         row("False-positive rate required", text_of(r.fpr)) +
         row("Detection",
             escaped_markup(r.reading) + (r.reading == "blind"
                                              ? ": image and extractor alone; key and message played no part"
                                              : "")) +
         "</table>\n";
}

std::string image_plot(const EvidenceRecord& r) {
  std::vector<bench::Bar> bars;
  double longest = -std::log10(r.fpr);
  for (std::size_t i = 0; i < std::min(r.images.size(), kPlottedImages); ++i) {
    const double p = r.images[i].score.p_value;
    bars.push_back({"image " + std::to_string(i + 1), -std::log10(p), "p " + rounded_up(p)});
    longest = std::max(longest, bars.back().value);
  }
  bars.push_back({"required", -std::log10(r.fpr), "p " + text_of(r.fpr)});
  const double full = 4 * std::max(1., std::ceil(longest / 4));
  std::string more;
  if (r.images.size() > kPlottedImages)
    more = " Only the first " + std::to_string(kPlottedImages) + " are drawn.";
  return "<figure role=\"img\" aria-label=\"Bars: evidence of each image by itself\">\n" +
         bench::bar_chart("Evidence of each image alone: -log10 of its p-value", bars, full) +
         "<figcaption>Each bar is one image alone; the verdict uses all images together." + more +
         "</figcaption></figure>\n";
}

// Returns the beginning of a table of images and their figures.
std::string scores_head(const char* caption, const char* image, const char* about) {
  std::string out = std::string("<table><caption>") + caption + "</caption>\n<thead><tr>";
  for (const char* column : {image, about, "Matching bits", "p, key", "two-sided", "p, bits"})
    out += std::string("<th scope=\"col\">") + column + "</th>";
  return out + "</tr></thead>\n<tbody>\n";
}

std::string scores_row(const std::string& alt, const std::string& source, const std::string& about,
                       const EvidenceScore& score) {
  return "<tr>" + cell("<img alt=\"" + alt + "\" src=\"" + source + "\">") + cell(about) +
         score_cells(score) + "</tr>\n";
}

std::string images_table(const EvidenceRecord& r, const PageImages& images) {
  std::string out = "<h2>Images</h2>\n" + image_plot(r) +
                    scores_head("Each image alone; bits that differ from the message are underlined", "Image",
                                "File and bits");
  for (std::size_t i = 0; i < r.images.size(); ++i) {
    const auto& image = r.images[i];
    const std::string label = std::to_string(i + 1) + ": " + escaped_markup(image.name);
    out +=
        scores_row("Image " + label, images.images.at(i),
                   label + "<br>" + marked_bits(image.score, r.message) + "<br>SHA-256 " + code(image.sha256),
                   image.score);
  }
  return out + "</tbody></table>\n";
}

std::string controls_table(const EvidenceRecord& r, const PageImages& images) {
  if (r.controls.empty()) return "";
  std::string out =
      "<h2>Controls</h2>\n" + controls_verdict(r) +
      scores_head("The same key, message and test on images without the mark", "Example", "Control");
  for (std::size_t i = 0; i < r.controls.size(); ++i) {
    const auto& control = r.controls[i];
    const std::string name = escaped_markup(control.name);
    double least = 1;
    for (const auto& image : control.images) least = std::min(least, image.score.p_value);
    out += scores_row("Control " + name, images.controls.at(i),
                      "<strong>" + name + "</strong>, " + std::to_string(control.images.size()) +
                          " together<br>" + escaped_markup(control.meaning) +
                          "<br>Smallest p of one alone: " + text_of(least),
                      control.together);
  }
  return out + "</tbody></table>\n";
}

std::string wrong_keys_section(const EvidenceRecord& r) {
  if (!r.wrong_keys) return "";
  const auto& w = *r.wrong_keys;
  using Counts = watermark::WrongKeyCounts;
  const std::string n = std::to_string(w.n);
  std::string out =
      "<h2>Wrong keys</h2>\n<p>The evidence of all images was tested under " + n +
      " random keys. The smallest p-value among them is " + text_of(w.least_p) +
      "; the key in question has " + text_of(r.together.p_value) +
      ".</p>\n<figure role=\"img\" aria-label=\"Histogram: statistic of wrong keys, and of the key in "
      "question\">\n" +
      bench::histogram_chart({.title = "Statistic T of " + n + " wrong keys",
                              .x = "T: 0 on average for a random key",
                              .counts = {w.histogram.begin(), w.histogram.end()},
                              .from = -Counts::kBins / 2. / Counts::kBinsPerUnit,
                              .bin = 1. / Counts::kBinsPerUnit,
                              .mark = r.together.statistic,
                              .mark_label = "the key in question"}) +
      "</figure>\n<table><caption>How often wrong keys reach a p-value</caption>\n<thead><tr><th "
      "scope=\"col\">p at most</th><th scope=\"col\">wrong keys</th><th scope=\"col\">99% interval of as "
      "many "
      "fair trials</th></tr></thead>\n<tbody>\n";
  for (int i = 0; i < Counts::kThresholds; ++i) {
    const auto interval = watermark::binomial_interval(w.n, std::pow(10., -1 - i));
    out += "<tr>" + number_cell("1e-" + std::to_string(i + 1)) +
           number_cell(std::to_string(w.counts[static_cast<std::size_t>(i)])) +
           number_cell(std::to_string(interval.low) + " to " + std::to_string(interval.high)) + "</tr>\n";
  }
  return out + "</tbody></table>\n<p>Counts below the interval are no fault: the p-value is a bound.</p>\n";
}

std::string identity(const EvidenceRecord& r, const watermark::PublicKey& signer) {
  return "<h2>Commitment and verification</h2>\n<table>\n" +
         row("Commitment (must have been time-stamped)", code(r.commitment)) +
         row("Public key of the signer", code(to_hex(signer))) +
         row("SHA-256 of the OWNER file", code(r.owner_sha256)) +
         row("Program", code(r.commit + ", kernels x86-64-" + r.isa + ", seed " + std::to_string(r.seed))) +
         "</table>\n"
         "<p>The commitment is the SHA-256 of the SHA-256 of the OWNER file, the key and the message; it "
         "gives "
         "none of "
         "them away. To check that nothing here was altered:</p>\n<pre><code>fieldmark check FOLDER "
         "IMAGES\nopenssl pkeyutl -verify -pubin -inkey public_key.pem -rawin -in evidence.json -sigfile "
         "evidence.sig</code></pre>\n<p>Whoever holds the OWNER file repeats the whole test with "
         "<code>fieldmark "
         "verify</code>.</p>\n";
}

}  // namespace

std::string thumbnail(const Tensor<float>& rgb) {
  const Index h = rgb.shape[0], w = rgb.shape[1], longer = std::max(h, w);
  const auto scaled = [&](Index side) { return std::max<Index>(1, side * kThumbnail / longer); };
  const auto jpeg = encode_jpeg(longer > kThumbnail ? resize_area(rgb, scaled(h), scaled(w)) : rgb, kQuality);
  return "data:image/jpeg;base64," + to_base64(jpeg);
}

std::string evidence_page(const EvidenceRecord& record, const watermark::PublicKey& signer,
                          const PageImages& images) {
  return kHead + std::string("<h1>Evidence of a mark</h1>\n") + verdict(record) + reservations(record) +
         controls_verdict(record) + kLimits + figures(record) + images_table(record, images) +
         controls_table(record, images) + wrong_keys_section(record) + identity(record, signer) +
         "</body>\n</html>\n";
}

}  // namespace fieldmark::cli
