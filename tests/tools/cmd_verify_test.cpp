#include <fieldmark/core/files.h>
#include <fieldmark/imaging/image.h>

#include <filesystem>

#include "cli/cli.h"
#include "imaging/video/video_samples.h"
#include "tools/tiny_job.h"

using namespace fieldmark;

namespace {
// Returns the number of places where two texts of one length have the same character.
int places_alike(const std::string& a, const std::string& b) {
  REQUIRE(a.size() == b.size());
  int alike = 0;
  for (std::size_t i = 0; i < a.size(); ++i) alike += a[i] == b[i];
  return alike;
}
}  // namespace

TEST_CASE("verify answers with numbers, and with exit code 3 where nothing is found", "[verify]") {
  const TinyJob& job = TinyJob::get();
  const std::string white = job.folder / "white.png";
  write_png(white, Tensor<float>({32, 32, 3}, 1.f));
  const auto r = run_command(
      {"verify", "--owner", job.owner, "--message", "5", "--wrong-keys", "500", white, "--json", "-"});
  INFO(r.err);
  CHECK(r.code == cli::kNotFound);
  const auto json = nlohmann::json::parse(r.out);
  CHECK_THAT(r.err, Contains("\nevidence this strong occurs by chance with a probability of up to "));
  CHECK(json["found"] == false);
  CHECK(json["p_value"] > 1e-6);
  CHECK(json["bits"] == 4);
  CHECK(json["views"] == 1);
  CHECK(json["wrong_keys"]["n"] == 500);
  for (const char* p : {"1e-1", "1e-2", "1e-3"})
    CHECK(json["wrong_keys"]["counts"][p].get<int>() <= json["wrong_keys"]["bounds_99"][p].get<int>());
  CHECK(json["wrong_keys"]["bounds_99"]["1e-1"] == 66);  // P(binomial(500, 0.1) > 66) = 0.9%
  CHECK(json["p_value_bits"].is_number());
  REQUIRE(json["seconds_per_image"].is_number());  // infinity and NaN are null
  CHECK(json["seconds_per_image"] > 0);
  REQUIRE(json["per_view"].size() == 1);
  CHECK(json["matching_bits"] == places_alike(json["per_view"][0]["bits"], "0101"));
}

TEST_CASE("verify counts evidence against the message in the two-sided p-value only", "[verify]") {
  const TinyJob& job = TinyJob::get();
  const std::string images = job.images();
  std::string copy;  // has a code of its own: of these, one reads bits with a small p-value
  const auto verified = [&](const std::string& message) {
    const auto r = run_command({"verify", "--detection", "blind", "--owner", job.owner, "--message", message,
                                "--copy", copy, images, "--json", "-"});
    INFO(r.err);
    REQUIRE(r.code == cli::kNotFound);
    return nlohmann::json::parse(r.out);
  };
  const char digits[] = "0123456789abcdef";
  std::string bits;
  int value = 0;
  for (const char* name : {"a", "b", "c", "d", "e", "f", "g", "h"}) {
    copy = name;
    const auto read = run_command(
        {"extract", "--detection", "blind", "--owner", job.owner, "--copy", copy, images, "--json", "-"});
    bits = nlohmann::json::parse(read.out)["bits"];
    REQUIRE(bits.size() == 4);
    value = std::stoi(bits, nullptr, 2);
    if (verified({digits[value]})["p_value"] < 0.5) break;
  }
  const auto same = verified({digits[value]}), opposite = verified({digits[15 - value]}),
             other = verified("5");
  const double one = same["p_value"], two = same["p_value_two_sided"];
  REQUIRE((one > 0 && one < 0.5));
  CHECK(two == Approx(2 * one));
  CHECK(opposite["p_value"] == 1);
  CHECK(opposite["p_value_two_sided"].get<double>() == Approx(two));
  CHECK(same["matching_bits"] == 4);
  CHECK(opposite["matching_bits"] == 0);
  CHECK(other["matching_bits"] == places_alike(bits, "0101"));
}

TEST_CASE("verify takes another key, and finds with a rate of 1 whatever it sees", "[verify]") {
  const TinyJob& job = TinyJob::get();
  const std::string key = test_key_file(job.folder, 6), images = job.images();
  CHECK(run_command(
            {"verify", "--detection", "blind", "--owner", job.owner, "--message", "5", "--key", key, images})
            .code == cli::kNotFound);
  CHECK(run_command(
            {"verify", "--detection", "blind", "--owner", job.owner, "--message", "5", "--fpr", "1", images})
            .code == cli::kOk);
}

TEST_CASE("verify says what speaks against the message", "[verify]") {
  const TinyJob& job = TinyJob::get();
  // At a rate of 1 everything is found, and these bits are noise.
  const auto read =
      run_command({"extract", "--detection", "blind", "--owner", job.owner, job.images(), "--json", "-"});
  const std::string bits = nlohmann::json::parse(read.out)["bits"];
  REQUIRE(bits.size() == 4);
  const auto digit = std::string(1, "0123456789abcdef"[std::stoi(bits, nullptr, 2)]);
  const auto verified = [&](const std::string& fpr) {
    return run_command({"verify", "--detection", "blind", "--owner", job.owner, "--message", digit, "--fpr",
                        fpr, job.images(), "--json", "-"});
  };
  const char* note = "counts only if the message was known before the images were read";
  const auto json = nlohmann::json::parse(verified("0.9").out);
  CHECK(json["contradicting_bits"] == 0);
  CHECK(json["matching_bits"] == json["bits"]);
  // Between the two p-values, the message that was read is found, but the bits are noise.
  const double p = json["p_value"], noise = json["p_noise"];
  REQUIRE(p < noise);
  const auto found = verified(std::to_string((p + noise) / 2));
  CHECK(found.code == cli::kOk);
  CHECK_THAT(found.err, Contains("FOUND: the images carry a mark of this key") && Contains(note) &&
                            Contains("\nif the key had nothing to do with the images, evidence this strong"));
  CHECK_THAT(verified("1").err, !Contains(note));
  CHECK_THAT(verified(std::to_string(p / 2)).err, Contains("NOT FOUND") && !Contains(note));
}

TEST_CASE("verify refuses a rate that no image can reach, and messages that do not fit", "[verify]") {
  const TinyJob& job = TinyJob::get();
  const std::string images = job.images();
  const auto rate =
      run_command({"verify", "--owner", job.owner, "--message", "5", "--fpr", "1e-100", images});
  CHECK(rate.code == cli::kUsage);
  CHECK_THAT(rate.err, Contains("--fpr"));
  const auto long_message =
      run_command({"verify", "--owner", job.owner, "--message", std::string(1000, 'a'), images});
  CHECK(long_message.code == cli::kUsage);
  CHECK_THAT(long_message.err, Contains("--message") && Contains("one for each cell, got 4000"));
  CHECK(run_command({"verify", "--owner", job.field, "--message", "5", images}).code == cli::kFailed);
}

TEST_CASE("verify tells of every view, and tests controls beside the images", "[verify]") {
  const TinyJob& job = TinyJob::get();
  const std::string images = job.images(), white = job.folder / "white.png";
  write_png(white, Tensor<float>({32, 32, 3}, 1.f));
  const auto r = run_command({"verify", "--detection", "blind", "--owner", job.owner, "--message", "5",
                              "--control", white, images, "--control", images, "--json", "-"});
  INFO(r.err);
  CHECK(r.code == cli::kNotFound);
  const auto json = nlohmann::json::parse(r.out);
  CHECK(json["views"] == 2);
  REQUIRE(json["per_view"].size() == 2);
  CHECK(json["per_view"][1]["bits"].get<std::string>().size() == 4);
  CHECK(json["per_view"][1]["bit_p_values"].size() == 4);
  REQUIRE(json["controls"].size() == 5);
  CHECK(json["controls"][3]["name"] == "white.png");
  CHECK(json["controls"][4]["statistic"] == json["statistic"]);
  for (const auto& control : json["controls"]) CHECK(control["found"] == false);
  CHECK(json["p_value_bits_two_sided"].is_number());
  CHECK(json["wrong_keys"].is_null());
}

TEST_CASE("verify counts the same wrong keys for any number of threads", "[verify]") {
  const TinyJob& job = TinyJob::get();
  const std::string images = job.images();
  const auto counted = [&](const char* threads) {
    const auto r = run_command({"verify", "--detection", "blind", "--owner", job.owner, "--message", "5",
                                "--wrong-keys", "20000", "--threads", threads, images, "--json", "-"});
    return nlohmann::json::parse(r.out)["wrong_keys"];
  };
  const auto one = counted("1"), two = counted("2");
  CHECK(one == two);
  CHECK(one["n"] == 20000);
  CHECK(one["intervals_99"]["1e-1"][0] > 1800);
  CHECK(one["intervals_99"]["1e-1"][1].get<double>() < 2200);
  CHECK(one["counts"]["1e-8"] == 0);
  const double least = one["least_p"];
  CHECK((least > 0 && least < 0.01));
}

TEST_CASE("verify writes equal evidence for equal work, and spares folders of others", "[verify]") {
  const TinyJob& job = TinyJob::get();
  const std::string images = job.images(), folder = job.folder / "proof";
  const auto verify = [&] {
    return run_command({"verify", "--detection", "blind", "--owner", job.owner, "--message", "5",
                        "--evidence", folder, "--wrong-keys", "200", images});
  };
  const auto first = verify();
  INFO(first.err);
  CHECK(first.code == cli::kNotFound);
  const std::string evidence = read_text(folder + "/evidence.json"),
                    page = read_text(folder + "/report.html");
  CHECK(verify().code == cli::kNotFound);
  CHECK(read_text(folder + "/evidence.json") == evidence);
  CHECK(read_text(folder + "/report.html") == page);
  CHECK_THAT(evidence, Contains("\"name\": \"view_000.png\"") && !Contains(job.folder.path.string()));
  CHECK_THAT(page, Contains("view_001.png") && !Contains(job.folder.path.string()));
  write_file_atomically(folder + "/letter.txt", std::string_view("mine"));
  const auto refused = verify();
  CHECK(refused.code == cli::kFailed);
  CHECK_THAT(refused.err, Contains("found letter.txt"));
  CHECK(read_text(folder + "/evidence.json") == evidence);
}

TEST_CASE("verify takes a video, and its evidence holds the frames and the hash of the file", "[verify]") {
  if (!video_or_skip()) return;
  const TinyJob& job = TinyJob::get();
  const TemporaryFolder folder;
  const std::string images = job.images(), clip = folder / "clip.mp4", proof = folder / "proof";
  VideoWriter writer(32, 32, {.frames_per_second = 2});
  for (const char* view : {"/view_000.png", "/view_001.png"}) writer.add(read_image(images + view));
  write_file_atomically(clip, std::span<const std::byte>(writer.finish()));
  const auto r = run_command({"verify", "--detection", "blind", "--owner", job.owner, "--message", "5",
                              "--evidence", proof, "--wrong-keys", "200", clip, "--json", "-"});
  INFO(r.err);
  REQUIRE(r.code == cli::kNotFound);
  const auto json = nlohmann::json::parse(r.out);
  CHECK(json["views"] == 2);
  CHECK(json["per_view"][1]["image"] == clip + "@0.500s");
  CHECK(json["per_view"][1]["time"] == 0.5);
  CHECK_THAT(read_text(proof + "/evidence.json"), Contains("\"name\": \"clip.mp4@0.500s\""));
  CHECK_THAT(run_command({"check", proof, clip}).out, Contains("INTACT"));
}

TEST_CASE("verify keeps readings from its results, and tests no wrong keys if told so", "[verify]") {
  const TinyJob& job = TinyJob::get();
  const std::string readings = job.folder / "readings";
  const auto same = run_command({"verify", "--owner", job.owner, "--message", "5", "--readings", readings,
                                 "--json", readings, job.images()});
  CHECK(same.code == cli::kUsage);
  CHECK_THAT(same.err, Contains("--json: " + readings + " is the value of --readings too"));
  const auto none =
      run_command({"verify", "--owner", job.owner, "--message", "5", "--detection", "blind", "--wrong-keys",
                   "0", "--evidence", job.folder / "no_keys", "--json", "-", job.images()});
  INFO(none.err);
  CHECK(nlohmann::json::parse(none.out)["wrong_keys"].is_null());
}
