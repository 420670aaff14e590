#include <fieldmark/tools/results/report.h>

#include <iostream>

#include "support/catch.h"
#include "tools/environment.h"

using namespace fieldmark::results;

TEST_CASE("markdown_table writes a header, a rule and the rows", "[report]") {
  CHECK(markdown_table({"a", "b"}, {{"1", "2"}, {"3", "4"}}) ==
        "| a | b |\n| --- | --- |\n| 1 | 2 |\n| 3 | 4 |\n");
  CHECK(markdown_table({"a"}, {{"x|y\nz"}}) == "| a |\n| --- |\n| x\\|y  z |\n");
}

TEST_CASE("markdown_list says how many rows it leaves out", "[report]") {
  Json list = Json::array();
  for (int i = 0; i < 203; ++i) list.push_back({{"n", i}});
  const std::string text = markdown_list(list, {});
  CHECK_THAT(text, Contains("| 199 |\n\nand 3 more, which the JSON has.\n") && !Contains("| 200 |"));
}

TEST_CASE("published_command shows no folder of this machine", "[report]") {
  {
    const EnvironmentVariable data("FIELDMARK_DATA", "/some/where/data");
    CHECK(published_command(
              {"fieldmark", "train", "--data", "/some/where/data/lego", "--out", "/tmp/x/lego.fm"}) ==
          "fieldmark train --data $FIELDMARK_DATA/lego --out lego.fm");
  }
  const EnvironmentVariable none("FIELDMARK_DATA", nullptr);
  CHECK(published_command({"/usr/bin/fieldmark", "a/b"}) == "fieldmark a/b");
}

TEST_CASE("markdown_report holds the protocol and every number", "[report]") {
  const Machine machine{
      .commit = "abc", .cpu = "Some CPU", .isa = "v3", .compiler = "GNU 12 -O2", .threads = 2};
  const nlohmann::ordered_json results{
      {"psnr", 30.51234567},
      {"lpips", nullptr},
      {"accuracy", {{"blind", 0.98}, {"informed", nullptr}}},
      {"rows", {{{"name", "x"}, {"gflops", 2}, {"inner", {1, 2}}}, {{"name", "y"}}}}};
  const auto text = markdown_report({"fieldmark", "eval", "--size", "9"}, machine, results);
  CHECK_THAT(text, Contains("# eval\n\n```\nfieldmark eval --size 9\n```\n"));
  CHECK_THAT(text, Contains("| commit | abc |") && Contains("| kernels | x86-64-v3 |") &&
                       Contains("| threads | 2 |"));
  CHECK_THAT(
      text,
      Contains("| psnr | 30.5123 |\n| lpips | - |\n| accuracy.blind | 0.98 |\n| accuracy.informed | - |"));
  CHECK_THAT(text, Contains("## rows\n\n| name | gflops |\n| --- | --- |\n| x | 2 |\n| y | - |\n"));
  CHECK(text == markdown_report({"fieldmark", "eval", "--size", "9"}, machine, results));
}

TEST_CASE("code_hash is of a room without those in it, or of all rooms of a house", "[report]") {
  const std::string imaging = code_hash({"imaging"});
  CHECK(imaging.size() == 64);
  if (machine().commit == "unknown") {
    std::cout << "SKIPPED: hashes of the sources' folders needs a git repository\n";
    return;
  }
  CHECK(imaging != code_hash({"imaging/video"}));
  CHECK(imaging != code_hash({"imaging", "imaging/video"}));
  CHECK(code_hash({"watermark"}) != code_hash({"watermark/keys"}));
  CHECK_THROWS_WITH(code_hash({"imag"}), "[code_hash] rooms: no sources in 'imag'");
}

TEST_CASE("machine() knows this one", "[report]") {
  const auto m = machine();
  CHECK(!m.commit.empty());
  CHECK(!m.cpu.empty());
  CHECK((m.isa == "v2" || m.isa == "v3" || m.isa == "v4"));
  CHECK(m.threads >= 1);
  CHECK(m.compiler.find("  ") == std::string::npos);
}
