#include <fieldmark/core/digest.h>
#include <fieldmark/core/error.h>
#include <fieldmark/core/files.h>
#include <fieldmark/watermark/evidence/evidence_folder.h>

#include <filesystem>
#include <fstream>

#include "support/catch.h"
#include "support/temporary_folder.h"
#include "watermark/small_evidence.h"

using namespace fieldmark;
using namespace fieldmark::watermark;
namespace fs = std::filesystem;

namespace {
// A folder of evidence about two existing images, and a third image that is unrelated.
struct Case {
  TemporaryFolder folder;
  fs::path evidence = folder / "evidence";
  std::vector<fs::path> images{folder / "view_0.png", folder / "cat.jpg"};
  explicit Case(EvidenceRecord record = small_evidence()) {
    write_file_atomically(images[0], std::string_view("first"));
    write_file_atomically(images[1], std::string_view("second"));
    record.images[0].sha256 = sha256_hex("first");
    record.controls.back().images[0].sha256 = sha256_hex("second");
    write_evidence_folder(evidence, record, "<!doctype html>", test_key(5));
  }
  // Writes the file plainly, because the tests do so thousands of times.
  void put(std::string_view name, const std::string& text) const {
    std::ofstream(evidence / name, std::ios::binary) << text;
  }
  EvidenceCheck check() const { return check_evidence_folder(evidence, images, public_key(test_key(5))); }
};
}  // namespace

TEST_CASE("evidence_folder: what was written passes, with its images") {
  const Case c;
  const EvidenceCheck check = c.check();
  CHECK(check.faults.empty());
  REQUIRE(check.summary);
  CHECK(check.summary->commitment == std::string(64, 'c'));
  CHECK(check.images == 1);
  CHECK(check.controls == 1);
  CHECK(std::distance(fs::directory_iterator(c.evidence), fs::directory_iterator()) ==
        static_cast<long>(kEvidenceFiles.size()));
  CHECK(fs::file_size(c.evidence / "evidence.sig") == 64);
  CHECK(check_evidence_folder(c.evidence, {}, {}).faults.empty());
}

TEST_CASE("evidence_folder: a mark that was not found has no soft binding") {
  const TemporaryFolder folder;
  const fs::path evidence = folder / "evidence", binding = evidence / "c2pa_soft_binding.json";
  write_evidence_folder(evidence, small_evidence(), "a", test_key(5));
  const std::string of_found = read_text(binding);
  EvidenceRecord missed = small_evidence();
  missed.fpr = missed.together.p_value / 2;
  write_evidence_folder(evidence, missed, "a", test_key(5));  // replaces what was found
  CHECK_FALSE(fs::exists(binding));
  CHECK(check_evidence_folder(evidence, {}, {}).faults.empty());
  write_file_atomically(binding, of_found);
  CHECK(check_evidence_folder(evidence, {}, {}).faults ==
        std::vector<std::string>{"c2pa_soft_binding.json is not listed in evidence.json"});
}

TEST_CASE("evidence_folder: every byte of every file is watched") {
  EvidenceRecord record = small_evidence();
  record.images.resize(1);
  record.controls.erase(record.controls.begin());
  record.wrong_keys.reset();
  const Case c(record);
  for (const std::string_view name : kEvidenceFiles) {
    const std::string text = read_text(c.evidence / name);
    // 0x01 keeps most letters and digits as letters and digits, so that the JSON still parses.
    for (std::size_t i = 0; i < text.size(); ++i) {
      std::string altered = text;
      altered[i] ^= 0x01;
      c.put(name, altered);
      INFO(name << ", byte " << i);
      REQUIRE_FALSE(c.check().faults.empty());
    }
    c.put(name, text + "\n");
    CHECK_FALSE(c.check().faults.empty());
    fs::remove(c.evidence / name);
    CHECK_FALSE(c.check().faults.empty());
    c.put(name, text);
    REQUIRE(c.check().faults.empty());
  }
}

TEST_CASE("evidence_folder: faults are named") {
  const Case c;
  const auto first_fault = [&] {
    const auto check = c.check();
    REQUIRE_FALSE(check.faults.empty());
    return check.faults[0];
  };
  write_file_atomically(c.images[0], std::string_view("First"));
  CHECK(first_fault() == "view_0.png is none of the images that the evidence is about, or was altered");
  write_file_atomically(c.images[0], std::string_view("first"));
  CHECK_THAT(check_evidence_folder(c.evidence, {}, public_key(test_key(6))).faults.at(0),
             Contains("signed by another key"));
  write_file_atomically(c.evidence / "report.html", std::string_view("<!doctype html> "));
  CHECK(first_fault() == "report.html was altered");
  fs::remove(c.evidence / "evidence.sig");
  CHECK_THAT(first_fault(), Contains("evidence.sig is missing"));
  CHECK_THROWS_AS(check_evidence_folder(c.folder / "none", {}, {}), IoError);
  CHECK_THROWS_WITH(check_evidence_folder(c.evidence, std::vector<fs::path>{c.folder / "none.png"}, {}),
                    Contains("none.png"));
}

TEST_CASE("evidence_folder: signed anew by somebody else, it is somebody else's") {
  const Case c;
  const auto stolen = c.folder / "stolen";
  EvidenceRecord record = small_evidence();
  record.commitment = std::string(64, 'e');
  write_evidence_folder(stolen, record, "", test_key(6));
  CHECK(check_evidence_folder(stolen, {}, {}).faults.empty());
  CHECK(check_evidence_folder(stolen, {}, public_key(test_key(5))).faults.size() == 1);
}

TEST_CASE("evidence_folder: only nothing and earlier evidence are replaced") {
  const TemporaryFolder folder;
  prepare_evidence_folder(folder / "new/inside");
  CHECK(fs::is_directory(folder / "new/inside"));
  write_evidence_folder(folder / "new/inside", small_evidence(), "a", test_key(5));
  write_evidence_folder(folder / "new/inside", small_evidence(), "b", test_key(5));
  CHECK(check_evidence_folder(folder / "new/inside", {}, {}).faults.empty());
  write_file_atomically(folder / "new/inside/letter.txt", std::string_view("mine"));
  CHECK_THROWS_WITH(prepare_evidence_folder(folder / "new/inside"),
                    Contains("expected an empty folder or one with earlier evidence only, found letter.txt"));
  CHECK_THROWS_WITH(prepare_evidence_folder(folder / "new/inside/letter.txt"), Contains("found a file"));
  CHECK(read_text(folder / "new/inside/letter.txt") == "mine");
  const fs::path too_long = folder / std::string(300, 'n');  // the system refuses to look it up
  CHECK_THROWS_AS(prepare_evidence_folder(too_long), IoError);
  CHECK_THROWS_AS(check_evidence_folder(too_long, {}, {}), IoError);
}
