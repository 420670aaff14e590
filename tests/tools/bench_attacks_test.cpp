#include <fieldmark/core/files.h>

#include "cli/cli.h"
#include "support/source_dir.h"
#include "tools/tiny_job.h"

using namespace fieldmark;

TEST_CASE("bench attacks has a row for each attack on images and files, with damage and evidence",
          "[bench]") {
  const TinyJob& job = TinyJob::get();
  const TemporaryFolder folder;
  const std::string baked = folder / "baked.fm", again = folder / "retold.fm";
  for (const auto& [message, out] : {std::pair{"5", baked}, {"a", again}})
    REQUIRE(run_command({"bake", "--owner", job.owner, "--message", message, "--out", out, "--steps", "1"})
                .code == cli::kOk);
  const auto r = run_command({"bench",
                              "attacks",
                              "--owner",
                              job.owner,
                              "--message",
                              "5",
                              "--informed-count",
                              "1",
                              "--field",
                              baked,
                              "--other",
                              again,
                              "--onto",
                              job.field,
                              "--attacked",
                              again,
                              "--count",
                              "2",
                              "--size",
                              "32",
                              "--quick",
                              "--json",
                              "-",
                              "--report",
                              folder / "attacks.md",
                              "--plot",
                              folder / "attacks.svg"});
  INFO(r.err);
  REQUIRE(r.code == cli::kOk);
  const auto json = nlohmann::json::parse(r.out);
  CHECK(json["views"] == 2);
  CHECK(json["informed_views"] == 1);
  CHECK(json["bits"] == 4);
  CHECK(json["unattacked"]["psnr_foreground"].is_null());
  const auto has = [](const nlohmann::json& rows, const std::string& name) {
    for (const auto& row : rows)
      if (row["attack"] == name) {
        for (const char* key : {"blind", "p_value", "psnr_foreground", "kept", "blind_p5"})
          CHECK(row.contains(key));
        for (const char* key : {"informed", "chosen"})
          CHECK((row[key].is_number() && row[key] >= 0 && row[key] <= 1));
        CHECK((row["blind"] >= 0 && row["blind"] <= 1 && row["p_value"] > 0 && row["p_value"] <= 1));
        return true;
      }
    return false;
  };
  for (const char* name : {"noise_0.10", "jpeg_50", "jpeg444_50", "scale-lanczos_0.5", "crop_0.40",
                           "greyscale", "screenshot,screenshot"})
    CHECK(has(json["images"], name));
  for (const char* name : {"weights_noise_0.1", "float16", "int6", "prune_0.5", "sign_flip_1.5",
                           "average_0.5", "copy_1", "retold"})
    CHECK(has(json["fields"], name));
  CHECK_THAT(read_text(folder / "attacks.md"), Contains("## images") && Contains("## fields"));
  for (const char* plot : {"attacks.svg", "attacks-fields.svg"})
    CHECK_THAT(read_text(folder / plot),
               Contains("class=\"curve\"") && Contains("grey levels") && Contains("chosen detection"));
}

TEST_CASE("bench attacks says that the bound of an owner of version 0.1 is not proven", "[bench]") {
  // The note comes before the field is read.
  const auto noted = [](const std::string& owner) {
    const auto r = run_command(
        {"bench", "attacks", "--owner", owner, "--field", "/no/such.fm", "--message", "5", "--count", "1"});
    CHECK(r.code == cli::kFailed);
    CHECK_THAT(r.err, Contains("/no/such.fm"));
    return r.out;
  };
  CHECK_THAT(noted(source_dir() + "/tests/regression/version_0_1/owner.fm"),
             Contains("note: the networks of this owner file were trained under its own key") &&
                 Contains("is not proven"));
  CHECK_THAT(noted(TinyJob::get().owner), !Contains("note: "));
}

TEST_CASE("bench attacks: what is missing", "[bench]") {
  const TinyJob& job = TinyJob::get();
  const auto r = run_command({"bench", "attacks", "--owner", job.owner, "--field", job.field});
  CHECK(r.code == cli::kUsage);
  CHECK_THAT(r.err, Contains("--message"));
  const auto text = run_command(
      {"bench", "attacks", "--owner", job.owner, "--field", job.field, "--text", "hello", "--count", "1"});
  CHECK(text.code == cli::kUsage);  // 4 bits are too few for a payload
  CHECK_THAT(text.err, Contains("--text"));
  CHECK(run_command({"bench", "attacks", "--owner", job.owner, "--field", job.field, "--message", "5",
                     "--attacked", "/no/such.fm"})
            .code == cli::kFailed);
}
