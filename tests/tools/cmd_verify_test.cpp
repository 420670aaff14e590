#include <fieldmark/engine/image.h>

#include "cli/cli.h"
#include "tools/tiny_job.h"

using namespace fieldmark;

TEST_CASE("verify answers with numbers, and with exit code 3 where nothing is found", "[verify]") {
  const TinyJob& job = TinyJob::get();
  const std::string white = job.folder / "white.png";
  write_png(white, Tensor<float>({32, 32, 3}, 1.f));
  const auto r = run_command(
      {"verify", "--owner", job.owner, "--message", "5", "--wrong-keys", "500", white, "--json", "-"});
  INFO(r.err);
  CHECK(r.code == cli::kNotFound);
  const auto json = nlohmann::json::parse(r.out);
  CHECK(json["found"] == false);
  CHECK(json["p_value"] > 1e-6);
  CHECK(json["bits"] == 4);
  CHECK(json["views"] == 1);
  CHECK(json["wrong_keys"]["n"] == 500);
  for (const char* p : {"1e-1", "1e-2", "1e-3"})
    CHECK(json["wrong_keys"]["counts"][p] <= json["wrong_keys"]["bounds_99"][p]);
  // Twice the one-sided where the evidence is for the message; evidence against it counts on one side only.
  const double one = json["p_value"], two = json["p_value_two_sided"];
  CHECK((one < 1 ? two == Approx(std::min(1.0, 2 * one)) : two <= 1));
  CHECK(json.contains("p_value_bits"));
  CHECK(json["matching_bits"] <= 4);
}

TEST_CASE("verify takes another key, and finds with a rate of 1 whatever it sees", "[verify]") {
  const TinyJob& job = TinyJob::get();
  const std::string key = job.folder / "other.key", pictures = job.pictures();
  REQUIRE(run_command({"key", "--out", key}).code == 0);
  CHECK(run_command({"verify", "--owner", job.owner, "--message", "5", "--key", key, pictures}).code ==
        cli::kNotFound);
  CHECK(run_command({"verify", "--owner", job.owner, "--message", "5", "--fpr", "1", pictures}).code ==
        cli::kOk);
}

TEST_CASE("verify refuses a rate that no picture can reach, and messages that do not fit", "[verify]") {
  const TinyJob& job = TinyJob::get();
  const std::string pictures = job.pictures();
  const auto rate =
      run_command({"verify", "--owner", job.owner, "--message", "5", "--fpr", "1e-100", pictures});
  CHECK(rate.code == cli::kUsage);
  CHECK_THAT(rate.err, Contains("--fpr"));
  CHECK(run_command({"verify", "--owner", job.owner, "--message", "123", pictures}).code == cli::kUsage);
  CHECK(run_command({"verify", "--owner", job.field, "--message", "5", pictures}).code == cli::kFailed);
}
