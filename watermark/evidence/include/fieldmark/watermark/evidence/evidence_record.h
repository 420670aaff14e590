#pragma once
#include <fieldmark/watermark/evidence/evidence_score.h>
#include <fieldmark/watermark/evidence/wrong_keys.h>
#include <fieldmark/watermark/keys/signing.h>

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace fieldmark::watermark {

/// One image and what it shows by itself.
struct EvidenceImage {
  std::string name;       ///< of the file, without folders
  std::string sha256;     ///< of the file's bytes; empty for an image that was made for a control
  Index width = 0;        ///< pixels
  Index height = 0;       ///< pixels
  EvidenceScore score{};  ///< under the key in question
};

/// Images that cannot show the mark, tested as those in question are.
struct EvidenceControl {
  std::string name;                     ///< one word, or the file or folder that was given
  std::string meaning;                  ///< a sentence on what it shows
  std::vector<EvidenceImage> images{};  ///< each by itself
  EvidenceScore together{};             ///< their evidence added up
};

/// What a test of images for a message found, with all that is needed to repeat it but the OWNER.
struct EvidenceRecord {
  std::string reading = "blind";               ///< how the images were read
  std::string owner_sha256{};                  ///< of the OWNER file
  std::string commitment{};                    ///< commitment()
  Message message{};                           ///< looked for
  double fpr = 1e-6;                           ///< rate of false alarms at which a mark counts as found
  Index cells = 0;                             ///< that carry a bit
  EvidenceScore together{};                    ///< the evidence of all images added up
  std::vector<EvidenceImage> images{};         ///< each by itself
  std::vector<EvidenceControl> controls{};     ///< may be none
  std::optional<WrongKeyCounts> wrong_keys{};  ///< of the evidence of all images, if they were counted
  std::uint64_t seed = 0;                      ///< of wrong keys and controls
  std::string commit{};                        ///< of the program
  std::string isa{};                           ///< kernels in use
  /// Whether the keyed p-value of all images is at most fpr.
  bool found() const { return together.p_value <= fpr; }
};

/// A record as text to be signed, canonical_json(): equal records give equal bytes. No time, host or path is
/// in it, nor the key. Bytes of file names that are no UTF-8 become U+FFFD.
/// @param signer  whose signature will stand beside it
/// @param files   SHA-256 of what else lies in the folder, by name
std::string evidence_json(const EvidenceRecord& record, const PublicKey& signer,
                          const std::map<std::string, std::string>& files);

/// What a reader of evidence needs of it.
struct EvidenceSummary {
  /// An image that the evidence is about.
  struct Image {
    std::string name;    ///< of the file
    std::string sha256;  ///< of its bytes; empty for an image made for a control
  };
  PublicKey signer{};                          ///< who is to have signed it
  std::string owner_sha256;                    ///< of the OWNER file
  std::string commitment;                      ///< commitment()
  Message message{};                           ///< looked for
  bool found = false;                          ///< the decision
  double fpr = 1;                              ///< rate of false alarms of the decision
  double p_value = 1;                          ///< of all images together
  std::vector<Image> images{};                 ///< in question
  std::vector<Image> controls{};               ///< images of all controls
  std::map<std::string, std::string> files{};  ///< SHA-256 of what else lies in the folder
};

/// Reads the text of evidence_json() and recomputes what follows from its other parts: p-values from the
/// statistic and the counts of bits, the number of matching bits, the decision.
/// @param name  stands for the file in error texts
/// @throws IoError if it is no evidence, is not in its canonical form, or says two things that do not fit
EvidenceSummary parse_evidence(std::string_view text, std::string_view name);

}  // namespace fieldmark::watermark
