#include "cli/training_attack.h"

#include <algorithm>

#include "cli/cli.h"
#include "nerf/small_field.h"
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

TEST_CASE("attack-field retrains a field as another kind", "[attack-field]") {
  const TemporaryFolder folder;
  const std::string hash = tiny_field(folder, tiny_scene(folder)), mlp = folder / "mlp.fm",
                    unbounded = folder / "unbounded.fm", out = folder / "out.fm";
  small_field(1, small_mlp_options()).save(mlp);
  const auto attack = [&](const std::string& field, const std::string& name, const std::string& preset) {
    return run_command({"attack-field", field, "--out", out, "--attack", name, "--preset", preset, "--views",
                        "4", "--size", "16", "--steps", "2", "--json", "-"});
  };
  const auto retrained = [&](const std::string& field, const std::string& preset) {
    const auto r = attack(field, "retrain", preset);
    INFO(r.err);
    REQUIRE(r.code == cli::kOk);
    CHECK(nlohmann::json::parse(r.out)["steps"] == 2);
    return nerf::RadianceField::load(out).options().field;
  };
  const nerf::FieldOptions from_hash = retrained(hash, "mlp"), from_mlp = retrained(mlp, "hash"),
                           same = retrained(hash, "hash");
  CHECK(from_hash.kind == nerf::FieldKind::mlp);
  CHECK(from_hash.mlp.width == 256);
  CHECK(from_mlp.kind == nerf::FieldKind::hash);
  CHECK(from_mlp.encoding.log2_table == 17);
  CHECK(same.kind == nerf::FieldKind::hash);
  CHECK(same.encoding.log2_table == trainable_field_options().field.encoding.log2_table);

  nerf::RadianceField field = small_field();
  field.space.kind = nerf::SpaceKind::contracted;
  field.save(unbounded);
  std::filesystem::remove(out);
  const auto refused = [&](const Outcome& r, const char* why) {
    CHECK(r.code == cli::kUsage);
    CHECK_THAT(r.err, Contains(why));
    CHECK(!std::filesystem::exists(out));
  };
  refused(attack(unbounded, "retrain", "mlp"), "--preset mlp: its samples are spread over straight rays");
  refused(attack(hash, "retrain", "paper"), "--preset");
  refused(attack(hash, "finetune-renders", "mlp"), "--preset: --attack finetune-renders does not use it");
  refused(run_command({"attack-field", hash, "--out", out, "--attack", "float16", "--preset", "mlp"}),
          "--preset: --attack float16 does not use it");
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
