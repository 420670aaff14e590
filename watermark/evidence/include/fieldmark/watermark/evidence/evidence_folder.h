#pragma once
#include <fieldmark/watermark/evidence/evidence_record.h>

#include <array>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace fieldmark::watermark {

/// What lies in a folder of evidence.
inline constexpr std::array<std::string_view, 5> kEvidenceFiles{
    "c2pa_soft_binding.json",  // soft_binding_json()
    "evidence.json",           // evidence_json()
    "evidence.sig",            // the 64 bytes of the signature of evidence.json
    "public_key.pem",          // to_pem() of who signed
    "report.html"              // for people
};

/// Makes the folder for evidence if it is not there; evidence that it holds already may be replaced.
/// @throws IoError if it is no folder, cannot be made, or holds anything else than kEvidenceFiles: what is
/// there stays
void prepare_evidence_folder(const std::filesystem::path& folder);

/// Writes kEvidenceFiles, the signature last and each file at once, so that a folder that was not finished
/// does not pass check_evidence_folder().
/// @param report  the page for people   @param key  which signs, see signing.h
/// @throws IoError as prepare_evidence_folder(), or if a file cannot be written
void write_evidence_folder(const std::filesystem::path& folder, const EvidenceRecord& record,
                           std::string_view report, const Key& key);

/// What became of a folder of evidence.
struct EvidenceCheck {
  std::vector<std::string> faults{};         ///< what was altered or is missing, one sentence each
  std::optional<EvidenceSummary> summary{};  ///< what it says, if that can be read
  Index images = 0;                          ///< given images that the evidence is about
};

/// Looks for alterations: the signature of evidence.json by the key named in it, the SHA-256 of the other
/// files, what follows from its figures, and the SHA-256 of images.
/// @param images  that the evidence should be about (in question, or of controls)
/// @param signer    whose signature it should be; without it anybody's counts
/// @throws IoError if there is no folder, or an image cannot be read
EvidenceCheck check_evidence_folder(const std::filesystem::path& folder,
                                    std::span<const std::filesystem::path> images,
                                    const std::optional<PublicKey>& signer);

}  // namespace fieldmark::watermark
