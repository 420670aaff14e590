#include "cli/training_attack.h"

#include <algorithm>

#include "cli/cli.h"
#include "tools/tiny_job.h"

using namespace fieldmark;

TEST_CASE("attack-field trains a field further, or a new one on its images", "[attack-field]") {
  const TemporaryFolder folder;
  const std::string scene = tiny_scene(folder), field = tiny_field(folder, scene), out = folder / "out.fm";
  const auto before = nerf::RadianceField::load(field);
  const auto run = [&](std::vector<std::string> words) {
    words.insert(words.begin(),
                 {"attack-field", field, "--out", out, "--steps", "5", "--json", "-", "--attack"});
    return run_command(words);
  };
  for (const auto& words :
       std::vector<std::vector<std::string>>{{"finetune", "--data", scene},
                                             {"finetune-renders", "--views", "4"},
                                             {"retrain", "--views", "4", "--size", "24"}}) {
    const auto r = run(words);
    INFO(r.err);
    REQUIRE(r.code == cli::kOk);
    const auto json = nlohmann::json::parse(r.out);
    CHECK(json["steps"] == 5);
    CHECK(json["attack"] == words[0]);
    const auto after = nerf::RadianceField::load(out);
    CHECK(!std::ranges::equal(after.params.values(), before.params.values()));
    // Further training keeps bounds and cameras; a new field chooses its own.
    CHECK((after.configuration() == before.configuration()) == (words[0] != "retrain"));
    std::filesystem::remove(out);
    const auto again = run(words);
    INFO(again.err);
    REQUIRE(again.code == cli::kOk);
    CHECK(std::ranges::equal(nerf::RadianceField::load(out).params.values(), after.params.values()));
  }
  CHECK_THAT(run({"finetune"}).err, Contains("needs --data"));
  CHECK(run({"finetune,float16", "--data", scene}).code == cli::kUsage);
  const auto ignored = run({"retrain", "--views", "4", "--lr", "0.1"});
  CHECK(ignored.code == cli::kUsage);
  CHECK_THAT(ignored.err, Contains("--lr: --attack retrain does not use it"));
}

TEST_CASE("attack-field turns images against a known extractor and trains the field on them",
          "[attack-field]") {
  const TinyJob& job = TinyJob::get();
  const TemporaryFolder folder;
  const std::string marked = folder / "marked.fm", out = folder / "out.fm";
  REQUIRE(
      run_command({"bake", "--owner", job.owner, "--message", "5", "--out", marked, "--steps", "2"}).code ==
      cli::kOk);
  const auto run = [&](std::vector<std::string> words) {
    words.insert(words.begin(), {"attack-field", marked, "--out", out, "--attack", "remove", "--steps", "3",
                                 "--views", "4", "--json", "-"});
    return run_command(words);
  };
  const auto r = run({"--owner", job.owner, "--mark-psnr", "30"});
  INFO(r.err);
  REQUIRE(r.code == cli::kOk);
  CHECK(nlohmann::json::parse(r.out)["steps"] == 3);
  const auto before = nerf::RadianceField::load(marked), after = nerf::RadianceField::load(out);
  CHECK(after.configuration() == before.configuration());
  CHECK(!std::ranges::equal(after.params.values(), before.params.values()));
  CHECK_THAT(run({}).err, Contains("--attack remove: needs --owner OWNER"));
  CHECK(run({"--owner", marked}).code == cli::kFailed);
}

TEST_CASE("a second mark goes on top of a baked field", "[attack-field]") {
  const TinyJob& job = TinyJob::get();
  const TemporaryFolder folder;
  const std::string first = folder / "first.fm", owner = folder / "second.owner", both = folder / "both.fm";
  REQUIRE(
      run_command({"bake", "--owner", job.owner, "--message", "5", "--out", first, "--steps", "2"}).code ==
      cli::kOk);
  REQUIRE(run_command({"embed", "--field", first, "--out", owner, "--key", test_key_file(folder), "--bits",
                       "4", "--cells", "6", "--reader-size", "32", "--steps", "2", "--views", "8",
                       "--measured-views", "1"})
              .code == cli::kOk);
  REQUIRE(run_command({"bake", "--owner", owner, "--message", "a", "--out", both, "--steps", "2"}).code ==
          cli::kOk);
  const auto one = nerf::RadianceField::load(first), two = nerf::RadianceField::load(both);
  CHECK(!std::ranges::equal(one.params.values(), two.params.values()));
  const auto r = run_command(
      {"measure", "--owner", job.owner, "--field", both, "--message", "5", "--count", "1", "--json", "-"});
  INFO(r.err);
  REQUIRE(r.code == cli::kOk);
  const auto json = nlohmann::json::parse(r.out);
  CHECK(json["baked"] == true);
  CHECK(json["accuracy"]["blind"].is_number());
}
