#include <fieldmark/watermark/attacks/field_attack.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "cli/cli.h"
#include "support/worst.h"
#include "tools/tiny_scene.h"

using namespace fieldmark;

namespace {

bool same_numbers(const nerf::RadianceField& a, const nerf::RadianceField& b) {
  return std::ranges::equal(a.params.values(), b.params.values());
}

}  // namespace

TEST_CASE("attack-field writes the field that the library makes, the same for the same seed",
          "[attack-field]") {
  const TemporaryFolder folder;
  const std::string field = tiny_field(folder, tiny_scene(folder));
  const auto before = nerf::RadianceField::load(field);
  const auto attack = [&](const std::string& out, const char* seed) {
    const auto r = run_command({"attack-field", field, "--out", folder / out, "--attack",
                                "weights_noise_0.1,float16", "--seed", seed, "--json", "-"});
    INFO(r.err);
    REQUIRE(r.code == cli::kOk);
    CHECK(nlohmann::json::parse(r.out)["attack"] == "weights_noise_0.1,float16");
    return nerf::RadianceField::load(folder / out);
  };
  const auto a = attack("a.fm", "3"), b = attack("b.fm", "3"), c = attack("c.fm", "4");
  CHECK(same_numbers(a, b));
  CHECK(!same_numbers(a, c));
  CHECK(same_numbers(
      a, watermark::apply_field_attack(watermark::parse_field_attack("weights_noise_0.1,float16"), before,
                                       CounterRng(3))));
  // Rounding numbers that are already rounded changes nothing.
  CHECK(same_numbers(
      a, watermark::apply_field_attack(watermark::parse_field_attack("float16"), a, CounterRng(3))));
}

TEST_CASE("attack-field with other fields, and their absence", "[attack-field]") {
  const TemporaryFolder folder;
  const std::string scene = tiny_scene(folder), field = tiny_field(folder, scene), marked = folder / "m.fm",
                    out = folder / "out.fm";
  REQUIRE(run_command({"attack-field", field, "--out", marked, "--attack", "weights_noise_0.1"}).code ==
          cli::kOk);
  const auto run = [&](std::vector<std::string> words) {
    words.insert(words.begin(), {"attack-field", marked, "--out", out});
    return run_command(words);
  };
  REQUIRE(run({"--attack", "sign_flip_1", "--unmarked", field}).code == cli::kOk);
  const auto plain = nerf::RadianceField::load(field), noisy = nerf::RadianceField::load(marked),
             undone = nerf::RadianceField::load(out);
  double worst = 0;
  for (std::size_t i = 0; i < plain.params.values().size(); ++i)
    raise_to(worst, std::abs(static_cast<double>(plain.params.values()[i] - undone.params.values()[i])));
  CHECK(worst < 1e-6);
  REQUIRE(run({"--attack", "average_0.5", "--other", field}).code == cli::kOk);
  const auto average = nerf::RadianceField::load(out);
  worst = 0;
  for (std::size_t i = 0; i < plain.params.values().size(); ++i) {
    const double a = plain.params.values()[i], b = noisy.params.values()[i];
    raise_to(worst, std::abs(average.params.values()[i] - (a + b) / 2));
  }
  CHECK(worst < 1e-6);
  const auto refused = [&](const std::vector<std::string>& words, const char* why) {
    const auto r = run(words);
    CHECK(r.code == cli::kUsage);
    CHECK_THAT(r.err, Contains(why));
  };
  refused({"--attack", "average_0.5"}, "--attack: needs --other FIELD");
  refused({"--attack", "copy_1", "--unmarked", field}, "--attack: needs --marked FIELD");
  refused({"--attack", "float16", "--other", field}, "--other: --attack does not use it");
  refused({"--attack", "float16", "--steps", "5"}, "--steps: --attack float16 does not use it");
  refused({"--attack", "remove", "--size", "32"}, "--size: --attack remove does not use it");
  refused({"--attack", "int9"}, "got 'int9'");
  const auto own = run_command({"attack-field", field, "--out", field, "--attack", "float16"});
  CHECK(own.code == cli::kUsage);
  CHECK_THAT(own.err, Contains("overwritten"));
  CHECK(run_command({"attack-field", "/no/such.fm", "--out", out, "--attack", "float16"}).code ==
        cli::kFailed);
}
