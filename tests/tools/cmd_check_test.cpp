#include <fieldmark/core/files.h>

#include <filesystem>

#include "cli/cli.h"
#include "tools/tiny_job.h"

using namespace fieldmark;

namespace {
struct Evidence {
  const TinyJob& job = TinyJob::get();
  std::string folder = job.folder / "evidence", images = job.images();
  nlohmann::json verified;
  Evidence() {
    const auto r =
        run_command({"verify", "--detection", "blind", "--owner", job.owner, "--message", "5", "--fpr", "1",
                     "--evidence", folder, "--wrong-keys", "300", images, "--json", "-"});
    INFO(r.err);
    REQUIRE(r.code == cli::kOk);
    verified = nlohmann::json::parse(r.out);
  }
};
}  // namespace

TEST_CASE("check passes the evidence that verify wrote, with its images and its signer", "[check]") {
  const Evidence e;
  const std::string signer = e.verified["public_key"];
  CHECK(signer == e.job.embedded["public_key"]);
  const auto r = run_command({"check", e.folder, e.images, "--public-key", signer, "--json", "-"});
  INFO(r.err);
  CHECK(r.code == cli::kOk);
  const auto json = nlohmann::json::parse(r.out);
  CHECK(json["intact"] == true);
  CHECK(json["faults"].empty());
  CHECK(json["images"] == 2);
  CHECK(json["images_known"] == 2);
  CHECK(json["images_tested"] == 2);
  CHECK(json["images_controls"] == 0);
  CHECK(json["images_in_evidence"] == 2);
  CHECK(json["copy"].is_null());
  CHECK(json["key_free"] == true);
  CHECK_THAT(run_command({"check", e.folder, e.images}).out,
             Contains("2 of 2 tested images given, and 0 images of controls"));
  CHECK(json["commitment"] == e.verified["commitment"]);
  CHECK(json["found"] == true);
  CHECK(json["message"] == "5");
  CHECK_THAT(run_command({"check", e.folder}).out, Contains(": INTACT") && Contains("not compared"));
}

TEST_CASE("check says what was altered, and ends with 1", "[check]") {
  const Evidence e;
  const auto failed = [&](std::vector<std::string> words, const char* what) {
    words.insert(words.begin(), {"check", e.folder});
    const auto r = run_command(words);
    CHECK(r.code == cli::kFailed);
    CHECK_THAT(r.out, Contains(what) && Contains(": ALTERED"));
  };
  failed({"--public-key", std::string(64, '0')}, "signed by another key");
  const std::string other = e.job.folder / "other.png";
  write_file_atomically(other, std::string_view("another image"));
  failed({other}, "other.png is none of the images");
  const std::string evidence = e.folder + "/evidence.json", report = e.folder + "/report.html";
  std::string text = read_text(evidence), page = read_text(report);
  write_file_atomically(report, page + " ");
  failed({}, "report.html was altered");
  write_file_atomically(report, page);
  text.replace(text.find("\"seed\": 1"), 9, "\"seed\": 2");
  write_file_atomically(evidence, text);
  failed({}, "the signature does not fit");
  CHECK(run_command({"check", e.job.folder / "nowhere"}).code == cli::kFailed);
  CHECK(run_command({"check", e.folder, "--public-key", "12"}).code == cli::kUsage);
  CHECK(run_command({"check"}).code == cli::kUsage);
}
