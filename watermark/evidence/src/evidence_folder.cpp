#include <fieldmark/core/digest.h>
#include <fieldmark/core/error.h>
#include <fieldmark/core/files.h>
#include <fieldmark/watermark/evidence/evidence_folder.h>
#include "soft_binding.h"

#include <algorithm>
#include <map>
#include <set>
#include <system_error>

namespace fieldmark::watermark {
namespace {

namespace fs = std::filesystem;
constexpr char kSoftBinding[] = "c2pa_soft_binding.json", kEvidence[] = "evidence.json",
               kSignature[] = "evidence.sig", kPublicKey[] = "public_key.pem", kReport[] = "report.html";

// Adds a fault if the file cannot be read.
std::optional<std::string> file_text(const fs::path& folder, const char* name, EvidenceCheck& check) {
  try {
    return read_text(folder / name);
  } catch (const IoError&) {
    check.faults.push_back(std::string(name) + " is missing or cannot be read");
    return {};
  }
}

void check_signature(const fs::path& folder, const std::string& evidence, EvidenceCheck& check) {
  const PublicKey& signer = check.summary->signer;
  if (const auto text = file_text(folder, kSignature, check)) {
    Signature signature;
    const bool whole = text->size() == signature.bytes.size();
    if (whole) std::copy(text->begin(), text->end(), signature.bytes.begin());
    if (!whole || !is_signed(evidence, signature, signer))
      check.faults.push_back("the signature does not fit: evidence.json or evidence.sig was altered");
  }
  const auto pem = file_text(folder, kPublicKey, check);
  if (pem && *pem != to_pem(signer))
    check.faults.push_back("public_key.pem is not the key that evidence.json names");
}

void check_files(const fs::path& folder, EvidenceCheck& check) {
  for (const char* name : {kSoftBinding, kReport}) {
    const auto listed = check.summary->files.find(name);
    const bool is_listed = listed != check.summary->files.end();
    // A mark that was not found has no soft binding.
    const bool needed = name == kReport || check.summary->found;
    if (!is_listed && !needed && !fs::exists(folder / name)) continue;
    const auto text = file_text(folder, name, check);
    if (!is_listed)
      check.faults.push_back(std::string(name) + " is not listed in evidence.json");
    else if (text && sha256_hex(*text) != listed->second)
      check.faults.push_back(std::string(name) + " was altered");
  }
}

void check_images(std::span<const fs::path> images, EvidenceCheck& check) {
  std::set<std::string> tested, controls;
  for (const auto& image : check.summary->images) tested.insert(image.sha256);
  for (const auto& image : check.summary->controls) controls.insert(image.sha256);
  for (const auto& path : images) {
    const std::string sha256 = sha256_file_hex(path);
    if (tested.contains(sha256))
      ++check.images;
    else if (controls.contains(sha256))
      ++check.controls;
    else
      check.faults.push_back(path.filename().string() +
                             " is none of the images that the evidence is about, or was altered");
  }
}

}  // namespace

void prepare_evidence_folder(const fs::path& folder) {
  std::error_code error;
  if (fs::exists(folder, error) && !fs::is_directory(folder, error))
    throw IoError(folder.string() + ": expected a folder for the evidence, found a file");
  fs::create_directories(folder, error);
  if (error) throw IoError(folder.string() + ": cannot be made: " + error.message());
  const fs::directory_iterator entries(folder, error);
  if (error) throw IoError(folder.string() + ": cannot be read: " + error.message());
  for (const auto& entry : entries) {
    const std::string name = entry.path().filename().string();
    if (std::find(kEvidenceFiles.begin(), kEvidenceFiles.end(), name) != kEvidenceFiles.end() &&
        entry.is_regular_file(error))
      continue;
    throw IoError(folder.string() + ": expected an empty folder or one with earlier evidence only, found " +
                  name);
  }
}

void write_evidence_folder(const fs::path& folder, const EvidenceRecord& record, std::string_view report,
                           const Key& key) {
  prepare_evidence_folder(folder);
  const PublicKey signer = public_key(key);
  // It states that the images carry the message.
  const std::string binding = record.found() ? soft_binding_json(record.message, record.commitment) : "";
  std::map<std::string, std::string> files{{kReport, sha256_hex(report)}};
  if (record.found()) files[kSoftBinding] = sha256_hex(binding);
  const std::string evidence = evidence_json(record, signer, files);
  fs::remove(folder / kSignature);  // of earlier evidence
  fs::remove(folder / kSoftBinding);
  if (record.found()) write_file_atomically(folder / kSoftBinding, binding);
  write_file_atomically(folder / kReport, report);
  write_file_atomically(folder / kPublicKey, to_pem(signer));
  write_file_atomically(folder / kEvidence, evidence);
  const Signature signature = sign(key, evidence);
  write_file_atomically(folder / kSignature, std::as_bytes(std::span(signature.bytes)));
}

EvidenceCheck check_evidence_folder(const fs::path& folder, std::span<const fs::path> images,
                                    const std::optional<PublicKey>& signer) {
  std::error_code error;
  if (!fs::is_directory(folder, error)) throw IoError(folder.string() + ": expected a folder with evidence");
  EvidenceCheck check;
  const auto evidence = file_text(folder, kEvidence, check);
  if (!evidence) return check;
  try {
    check.summary = parse_evidence(*evidence, kEvidence);
  } catch (const IoError& e) {
    check.faults.push_back(e.what());
    return check;
  }
  check_signature(folder, *evidence, check);
  if (signer && *signer != check.summary->signer)
    check.faults.push_back("signed by another key: expected " + to_hex(*signer) + ", found " +
                           to_hex(check.summary->signer));
  check_files(folder, check);
  check_images(images, check);
  return check;
}

}  // namespace fieldmark::watermark
