#include <fieldmark/imaging/lpips.h>
#include <fieldmark/watermark/attacks/measurement.h>

#include "cli/cli.h"
#include "support/random_weights.h"
#include "tools/tiny_job.h"

using namespace fieldmark;

TEST_CASE("measure reports an owner's mark on several sets of cameras", "[measure]") {
  const TinyJob& job = TinyJob::get();
  const auto owner = watermark::Owner::load(job.owner);
  for (const char* cameras : {"novel", "ring", "sphere"}) {
    const auto r = run_command({"measure", "--owner", job.owner, "--cameras", cameras, "--count", "2",
                                "--informed-count", "1", "--json", "-"});
    INFO(r.err);
    REQUIRE(r.code == cli::kOk);
    const auto json = nlohmann::json::parse(r.out);
    CHECK(json["cameras"] == cameras);
    CHECK(json["views"] == 2);
    CHECK(json["baked"] == false);
    const auto expected = watermark::measure(
        owner, nullptr, nullptr,
        {.cameras = nerf::make_cameras(owner.field.cameras, nerf::parse_camera_set(cameras), 2, 0, 1),
         .informed_views = 1,
         .seed = 1});
    CHECK(json["accuracy"]["blind"] == expected.accuracy.blind);
    CHECK(json["accuracy"]["informed"] == expected.accuracy.informed);
    CHECK(json["accuracy"]["chosen"] == expected.accuracy.chosen);
    CHECK(json["accuracy_p5"] == expected.accuracy_p5);
    CHECK(json["psnr_base"] == expected.psnr_base);
    CHECK(json["psnr_base_foreground"] == expected.psnr_base_foreground);
    CHECK(json["ssim_base"] == expected.ssim_base);
    CHECK(json["informed_views"] == 1);
    CHECK(json["informed_seconds"] > 0);
    CHECK(json["blind_seconds"] > 0);
  }
}

TEST_CASE("measure says that an unmarked field does not differ", "[measure]") {
  const TinyJob& job = TinyJob::get();
  const auto r = run_command({"measure", "--owner", job.owner, "--field", job.field, "--message", "a",
                              "--count", "1", "--informed-count", "0", "--json", "-"});
  INFO(r.err);
  REQUIRE(r.code == cli::kOk);
  CHECK_THAT(r.err, Contains("against unmarked     no pixel differs"));
  CHECK(nlohmann::json::parse(r.out)["psnr_base"].is_null());
}

TEST_CASE("measure gives a row for each of several sets of cameras", "[measure]") {
  const TinyJob& job = TinyJob::get();
  const TemporaryFolder folder;
  const auto r = run_command({"measure", "--owner", job.owner, "--cameras",
                              "sphere,extrapolated,closer,farther", "--count", "2", "--informed-count", "0",
                              "--distort", "blur_1", "--json", "-", "--report", folder / "measure.md"});
  INFO(r.err);
  REQUIRE(r.code == cli::kOk);
  const auto json = nlohmann::json::parse(r.out);
  CHECK(json["cameras"] == "sphere");
  REQUIRE(json["rows"].size() == 4);
  const char* sets[] = {"sphere", "extrapolated", "closer", "farther"};
  for (std::size_t i = 0; i < 4; ++i) {
    const auto& row = json["rows"][i];
    CHECK(row["cameras"] == sets[i]);
    CHECK(row["views"] == 2);
    CHECK(row["blind"].is_number());
    CHECK(row["blur_1 blind"].is_number());
    CHECK(row["psnr_base_foreground"].is_number());
    CHECK(row["informed"].is_null());
  }
  CHECK(json["rows"][0]["blind"] == json["accuracy"]["blind"]);
  CHECK(json["rows"][2]["psnr_base_foreground"] != json["rows"][3]["psnr_base_foreground"]);
  CHECK_THAT(read_text(folder / "measure.md"), Contains("| farther | 2 |"));
  CHECK_THAT(r.err, Contains("2 views of extrapolated cameras"));
  CHECK(run_command({"measure", "--owner", job.owner, "--cameras", "novel,moon"}).code == cli::kUsage);
}

TEST_CASE("measure gives LPIPS against the unmarked renders where there are weights", "[measure]") {
  const TinyJob& job = TinyJob::get();
  const TemporaryFolder folder;
  const std::string weights = folder / "alex.safetensors";
  random_weights(lpips_tensors(LpipsNetwork::alex)).write(weights);
  const auto lpips_at = [&](const std::string& file, const char* size) {
    const auto r = run_command({"measure", "--informed-count", "0", "--owner", job.owner, "--count", "2",
                                "--size", size, "--lpips-weights", file, "--json", "-"});
    INFO(r.err);
    REQUIRE(r.code == cli::kOk);
    return nlohmann::json::parse(r.out)["lpips_base"];
  };
  CHECK(lpips_at(weights, "40").get<double>() > 0);
  CHECK(lpips_at(weights, "24").is_null());  // too small for the network
  CHECK(lpips_at("none", "40").is_null());
  const auto wrong = run_command({"measure", "--owner", job.owner, "--lpips-weights", job.owner});
  CHECK(wrong.code == cli::kFailed);
  CHECK_THAT(wrong.err, Contains("scaling.shift"));
}

TEST_CASE("measure wants field and message together, and known distortions", "[measure]") {
  const TinyJob& job = TinyJob::get();
  const auto refused = [&](std::vector<std::string> more, const char* why) {
    more.insert(more.begin(), {"measure", "--owner", job.owner});
    const auto r = run_command(more);
    CHECK(r.code == cli::kUsage);
    CHECK_THAT(r.err, Contains(why));
  };
  refused({"--field", job.field}, "--field: needs the message baked into it");
  refused({"--message", "5"}, "--message: needs --field");
  refused({"--count", "1", "--distort", "melt_3"}, "--distort: ");
  refused({"--cameras", "test"}, "--cameras test: needs --data DIR");
  refused({"--data", job.folder.path}, "--data: needs --field or --cameras test");
  refused({"--data", job.folder.path, "--cameras", "test", "--count", "2"},
          "--count: --cameras test takes all test cameras of --data");
  refused({"--together", "2", "--count", "2"}, "--together: needs --payloads");
  CHECK(run_command({"measure", "--owner", job.field, "--count", "1"}).code == cli::kFailed);
}
