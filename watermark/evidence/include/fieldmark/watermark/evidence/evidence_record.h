#pragma once
#include <fieldmark/watermark/evidence/evidence.h>
#include <fieldmark/watermark/evidence/wrong_keys.h>
#include <fieldmark/watermark/keys/signing.h>

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace fieldmark::watermark {

/// One image and its own score.
struct EvidenceImage {
  std::string name;       ///< of the file, without folders
  std::string sha256;     ///< of the file's bytes; empty for a generated control
  Index width = 0;        ///< pixels
  Index height = 0;       ///< pixels
  EvidenceScore score{};  ///< under the tested key
};

/// A control, tested like the images.
struct EvidenceControl {
  std::string name;                     ///< one word, or the given file or folder
  std::string meaning;                  ///< a sentence for readers
  std::vector<EvidenceImage> images{};  ///< scored one by one
  EvidenceScore together{};             ///< their summed evidence
};

/// Result of testing images for a message, with all that is needed to repeat the test except the OWNER.
struct EvidenceRecord {
  std::string reading = "blind";  ///< detector: "blind", "informed" or "mixed"
  std::string owner_sha256{};     ///< of the OWNER file
  std::string commitment{};       ///< commitment()
  Message message{};              ///< the message tested for
  std::string copy{};             ///< recipient whose copy was tested for; empty: none
  bool key_free = true;      ///< see Owner::key_free(): without it, the bound of the p-values is not proven
  double fpr = 1e-6;         ///< rate of false alarms at which a mark counts as found
  Index cells = 0;           ///< cells that carry a bit
  EvidenceScore together{};  ///< summed evidence of all images
  std::vector<EvidenceImage> images{};         ///< scored one by one
  std::vector<EvidenceControl> controls{};     ///< may be empty
  std::optional<WrongKeyCounts> wrong_keys{};  ///< for the summed evidence; empty if not counted
  std::uint64_t seed = 0;                      ///< of wrong keys and controls
  std::string commit{};                        ///< of the program's source
  std::string isa{};                           ///< kernels in use
  /// True if the keyed p-value of all images is at most fpr.
  bool found() const { return together.p_value <= fpr; }
};

/// Serialises a record for signing, see canonical_json(): equal records give equal bytes. The text holds no
/// time, host, path or key. Invalid UTF-8 in file names becomes U+FFFD.
/// @param signer  of the signature file   @param files  SHA-256 of the other files in the folder, by name
std::string evidence_json(const EvidenceRecord& record, const PublicKey& signer,
                          const std::map<std::string, std::string>& files);

/// The parts of evidence that a reader needs.
struct EvidenceSummary {
  /// A tested image.
  struct Image {
    std::string name;    ///< of the file
    std::string sha256;  ///< of its bytes; empty for a generated control
  };
  PublicKey signer{};                          ///< signer that the text names
  std::string owner_sha256;                    ///< of the OWNER file
  std::string commitment;                      ///< commitment()
  Message message{};                           ///< the message tested for
  std::string copy{};                          ///< recipient whose copy was tested for; empty: none
  bool key_free = true;                        ///< of EvidenceRecord
  bool found = false;                          ///< the decision
  double fpr = 1;                              ///< rate of false alarms of the decision
  double p_value = 1;                          ///< of all images together
  std::vector<Image> images{};                 ///< tested
  std::vector<Image> controls{};               ///< images of all controls
  std::map<std::string, std::string> files{};  ///< SHA-256 of the other files in the folder
};

/// Parses the text of evidence_json() and recomputes the p-values of the key and of the matching bits and the
/// decision, and checks the number of matching bits against the bits.
/// @param name  stands for the file in error messages
/// @throws IoError if the text is not evidence, not canonical, or inconsistent
EvidenceSummary parse_evidence(std::string_view text, std::string_view name);

}  // namespace fieldmark::watermark
