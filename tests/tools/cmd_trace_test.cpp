#include <fieldmark/core/digest.h>
#include <fieldmark/core/files.h>
#include <fieldmark/imaging/image.h>
#include <fieldmark/watermark/evidence/commitment.h>
#include <fieldmark/watermark/reading/blind_reader.h>
#include <fieldmark/watermark/tracing/trace.h>

#include <filesystem>

#include "cli/cli.h"
#include "tools/tiny_job.h"

using namespace fieldmark;

TEST_CASE("trace answers for every recipient, and with exit code 3 where nobody is found", "[trace]") {
  const TinyJob& job = TinyJob::get();
  const std::string names = job.folder / "names.txt";
  write_file_atomically(names, "Anna\nBertil\nCecilia\n");
  const auto r = run_command({"trace", "--owner", job.owner, "--message", "5", "--copies", names,
                              "--detection", "blind", job.images(), "--json", "-"});
  INFO(r.err);
  CHECK(r.code == cli::kNotFound);
  CHECK_THAT(r.err, Contains("NOT FOUND: 0 of 3 recipients"));
  const auto json = nlohmann::json::parse(r.out);
  CHECK(json["tested"] == 3);
  CHECK(json["views"] == 2);
  REQUIRE(json["recipients"].size() == 3);
  double last = 0;
  for (const auto& recipient : json["recipients"]) {
    CHECK(recipient["found"] == false);
    CHECK(recipient["p_value"] >= last);
    CHECK(recipient["p_corrected"] >= recipient["p_value"]);
    last = recipient["p_value"];
  }
}

TEST_CASE("trace names the list, the owner file and the commitment that it tested", "[trace]") {
  const TinyJob& job = TinyJob::get();
  const std::string names = job.folder / "unsorted.txt", key = test_key_file(job.folder, 6);
  write_file_atomically(names, "Cecilia\n\nAnna\r\n Bertil");
  const auto traced = [&](const std::vector<std::string>& more) {
    std::vector<std::string> words{"trace",    "--owner",     job.owner, "--message", "5",
                                   "--copies", names,         "--fpr",   "1",         "--json",
                                   "-",        "--detection", "blind",   job.images()};
    words.insert(words.end(), more.begin(), more.end());
    const auto r = run_command(words);
    INFO(r.err);
    REQUIRE(r.code == cli::kOk);
    return r;
  };
  const std::string list = sha256_hex("Anna\nBertil\nCecilia\n"), owner = sha256_file_hex(job.owner);
  const auto commitment = [&](unsigned first) {
    return watermark::commitment(owner, test_key(first), watermark::message_from_hex("5", 4));
  };
  const auto r = traced({});
  CHECK_THAT(r.err, Contains("list sha256  " + list + "\nowner sha256 " + owner + "\ncommitment   "));
  const auto json = nlohmann::json::parse(r.out);
  CHECK(json["list_sha256"] == list);
  CHECK(json["owner_sha256"] == owner);
  CHECK(json["commitment"] == commitment(5));
  CHECK(nlohmann::json::parse(traced({"--key", key}).out)["commitment"] == commitment(6));
}

TEST_CASE("trace finds at a rate of 1 whomever it tests, verify and bake take one copy", "[trace]") {
  const TinyJob& job = TinyJob::get();
  const std::string names = job.folder / "one.txt", images = job.images(), baked = job.folder / "anna.fm";
  write_file_atomically(names, "Anna\n");
  CHECK(run_command({"trace", "--owner", job.owner, "--message", "5", "--copies", names, "--fpr", "1",
                     "--detection", "blind", images})
            .code == cli::kOk);
  const auto bake = run_command({"bake", "--owner", job.owner, "--message", "5", "--copy", "Anna", "--out",
                                 baked, "--steps", "1", "--json", "-"});
  INFO(bake.err);
  REQUIRE(bake.code == cli::kOk);
  CHECK(nlohmann::json::parse(bake.out)["copy"] == "Anna");
  const std::string plain = job.folder / "plain.fm";
  REQUIRE(
      run_command({"bake", "--owner", job.owner, "--message", "5", "--out", plain, "--steps", "1"}).code ==
      cli::kOk);
  CHECK(read_text(plain) != read_text(baked));  // another code is baked
  const auto statistic = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"verify", "--owner", job.owner, "--message", "5", "--detection", "blind"});
    more.insert(more.end(), {images, "--json", "-"});
    return nlohmann::json::parse(run_command(more).out)["statistic"].get<double>();
  };
  const auto traced =
      nlohmann::json::parse(run_command({"trace", "--owner", job.owner, "--message", "5", "--copies", names,
                                         "--detection", "blind", images, "--json", "-"})
                                .out);
  const auto& anna = traced["recipients"][0];
  CHECK(anna["round"] == 1);
  const auto owner = watermark::Owner::load(job.owner);
  const watermark::BlindReader reader(owner);
  std::vector<double> sum(static_cast<std::size_t>(owner.cells.count()));
  for (const auto& file : std::filesystem::directory_iterator(images)) {
    const auto evidence = reader.evidence(read_image(file.path()));
    for (std::size_t c = 0; c < sum.size(); ++c) sum[c] += evidence[c];
  }
  const std::vector<std::string> only{"Anna"};
  const auto want = watermark::trace_copies(sum, owner.cells.weights(), owner.own_key(),
                                            watermark::message_from_hex("5", 4), only, 1e-6);
  CHECK(anna["statistic"].get<double>() == Approx(want[0].statistic).epsilon(1e-9));
  CHECK(anna["p_value"].get<double>() == Approx(want[0].p_value).epsilon(1e-9));
  CHECK(statistic({"--copy", "Anna"}) != statistic({}));
}

TEST_CASE("trace refuses a rate that no image can reach", "[trace]") {
  const TinyJob& job = TinyJob::get();
  const std::string names = job.folder / "three.txt";
  write_file_atomically(names, "Anna\nBertil\nCecilia\n");
  const auto r = run_command(
      {"trace", "--owner", job.owner, "--message", "5", "--copies", names, "--fpr", "1e-200", job.images()});
  CHECK(r.code == cli::kUsage);
  CHECK_THAT(r.err, Contains("cells no image can reach 1e-200, the smallest p-value is"));
}

TEST_CASE("trace refuses lists that name nobody or one twice", "[trace]") {
  const TinyJob& job = TinyJob::get();
  const std::string names = job.folder / "twice.txt";
  write_file_atomically(names, "Anna\nAnna\n");
  const auto r =
      run_command({"trace", "--owner", job.owner, "--message", "5", "--copies", names, job.images()});
  CHECK(r.code == cli::kFailed);
  CHECK_THAT(r.err, Contains("twice.txt: line 2: expected each recipient once"));
}
