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

/// Files of an evidence folder.
inline constexpr std::array<std::string_view, 5> kEvidenceFiles{
    "c2pa_soft_binding.json",  // soft_binding_json(), if the mark was found
    "evidence.json",           // evidence_json()
    "evidence.sig",            // the 64 bytes of the signature of evidence.json
    "public_key.pem",          // to_pem() of the signer
    "report.html"              // for readers
};

/// Creates the folder for evidence; earlier evidence in it may be replaced.
/// @throws IoError if it is not a folder, cannot be created, or holds files other than kEvidenceFiles, which
/// are kept
void prepare_evidence_folder(const std::filesystem::path& folder);

/// Writes kEvidenceFiles atomically, the signature last, so that an unfinished folder fails
/// check_evidence_folder().
/// @param report  the HTML page   @param key  signs, see signing.h
/// @throws IoError as prepare_evidence_folder(), or if a file cannot be written
void write_evidence_folder(const std::filesystem::path& folder, const EvidenceRecord& record,
                           std::string_view report, const Key& key);

/// Result of checking an evidence folder.
struct EvidenceCheck {
  std::vector<std::string> faults{};         ///< altered or missing parts, one sentence each
  std::optional<EvidenceSummary> summary{};  ///< its content, if readable
  Index images = 0;                          ///< given images that the evidence tested
  Index controls = 0;                        ///< given images that it tested as controls
};

/// Checks the signature of evidence.json by the key in it, the SHA-256 of the other files and of the images,
/// and the consistency of its figures.
/// @param images  images that the evidence should cover (tested images or controls)
/// @param signer  the expected signer; any signer if absent
/// @throws IoError if there is no folder or an image cannot be read
EvidenceCheck check_evidence_folder(const std::filesystem::path& folder,
                                    std::span<const std::filesystem::path> images,
                                    const std::optional<PublicKey>& signer);

}  // namespace fieldmark::watermark
