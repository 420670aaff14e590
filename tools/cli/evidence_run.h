#pragma once
#include <fieldmark/watermark/evidence/evidence_record.h>
#include <fieldmark/watermark/mark/owner.h>

#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

#include "cli/context.h"
#include "cli/evidence_page.h"
#include "cli/reading.h"

namespace fieldmark::cli {

/// Tests evidence for the message under the key.
struct KeyTest {
  const watermark::Owner& owner;      ///< of the field in question
  const watermark::CellCode& code;    ///< of the key in question
  const watermark::Message& message;  ///< the message to look for
  watermark::EvidenceScore operator()(const std::vector<double>& cells) const {
    return watermark::score_evidence(cells, code, message);
  }
};

/// Scores each image by itself.
std::vector<watermark::EvidenceImage> score_images(const KeyTest& test,
                                                   const std::vector<ImageEvidence>& images);

/// Controls and a thumbnail of the first image of each.
struct TestedControls {
  std::vector<watermark::EvidenceControl> controls{};
  std::vector<std::string> thumbnails{};
};

/// Tests controls with the same detection: the built-in ones (watermark::built_in_controls()) of the first
/// five images, and each image or folder of `given`, which the user declares unmarked.
/// @throws IoError as read_images()
TestedControls test_controls(const KeyTest& test, SuspectReader& reader,
                             const std::vector<ImageEvidence>& images, const std::vector<std::string>& given,
                             std::optional<Index> frames, Context& context);

/// For --json: name, figures and whether the control stays above the rate of false alarms.
Json controls_json(const std::vector<watermark::EvidenceControl>& controls, double fpr);

/// For --json: name, bits, p-value of each bit and scores of each image.
Json per_view_json(const std::vector<ImageEvidence>& images,
                   const std::vector<watermark::EvidenceImage>& scores);

/// Prints a line per image: bits, matching bits, p-value, p-value of the weakest bit.
void print_views(std::ostream& out, const std::vector<ImageEvidence>& images,
                 const std::vector<watermark::EvidenceImage>& scores);

/// Says how sure a verdict is: how often evidence this strong occurs by chance, and if nothing was found,
/// whether it was a near miss, that is, evidence that falls short of the required rate.
/// @param p_value  of the key, all images together   @param fpr  largest p-value that counts as found
std::string verdict_sentence(double p_value, double fpr);

/// Prints how often keys reach each p-value, next to the bounds of chance, one line per threshold, and
/// returns it for --json.
/// @param of  what was counted: "wrong keys"
Json key_counts(const watermark::WrongKeyCounts& found, const std::string& of, Context& context);

/// Prints a line per control.
void print_controls(std::ostream& out, const std::vector<watermark::EvidenceControl>& controls, double fpr);

/// Writes the folder of --evidence (watermark::write_evidence_folder()) with its page.
void write_evidence(const std::string& folder, const watermark::EvidenceRecord& record,
                    const std::vector<ImageEvidence>& images, const std::vector<std::string>& controls,
                    const watermark::Owner& owner, const watermark::Key& key);

}  // namespace fieldmark::cli
