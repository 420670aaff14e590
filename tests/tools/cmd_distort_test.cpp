#include <fieldmark/core/files.h>
#include <fieldmark/imaging/image.h>

#include <nlohmann/json.hpp>

#include "cli/cli.h"
#include "support/catch.h"
#include "support/random.h"
#include "support/temporary_folder.h"
#include "tools/run_command.h"

using namespace fieldmark;

TEST_CASE("distort leaves out a broken image and goes on", "[attack]") {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder / "in");
  write_png(folder / "in/a.png", Tensor<float>({8, 8, 3}, 0.5f));
  write_file_atomically(folder / "in/b.png", std::string_view("no image"));
  write_png(folder / "in/c.png", Tensor<float>({8, 8, 3}, 0.5f));
  const auto r = run_command({"distort", folder / "in", "--out", folder / "out", "--distort", "greyscale"});
  CHECK(r.code == cli::kFailed);
  CHECK_THAT(r.out, Contains("left out") && Contains("b.png") && Contains(": 2 images after greyscale"));
  CHECK(std::filesystem::exists(folder / "out/a.png"));
  CHECK(std::filesystem::exists(folder / "out/c.png"));
}

TEST_CASE("attack writes one image for each, the same for the same seed", "[attack]") {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder / "in");
  write_png(folder / "in/r_0.png", uniform<float>({8, 8, 3}, 0, 1, 1));
  write_png(folder / "in/r_1.png", uniform<float>({8, 8, 4}, 0, 1, 2));
  const auto attack = [&](const std::string& out, const std::string& seed) {
    return run_command({"distort", folder / "in", "--out", folder / out, "--distort", "scale_0.5,noise_0.1",
                        "--seed", seed, "--json", "-"});
  };
  const auto r = attack("a", "1");
  CHECK(r.code == cli::kOk);
  CHECK(nlohmann::json::parse(r.out)["images"].size() == 2);
  REQUIRE(attack("b", "1").code == cli::kOk);
  REQUIRE(attack("c", "2").code == cli::kOk);
  const auto a = read_image(folder / "a/r_1.png");
  CHECK(a.shape == Shape{4, 4, 3});
  CHECK(a.data == read_image(folder / "b/r_1.png").data);
  CHECK(a.data != read_image(folder / "c/r_1.png").data);
  CHECK(a.data != read_image(folder / "a/r_0.png").data);
}

TEST_CASE("attack by an unknown name or out of its range is a usage error", "[attack]") {
  const TemporaryFolder folder;
  write_png(folder / "x.png", Tensor<float>({2, 2, 3}));
  for (const char* name : {"nois_0.1", "noise_7", "noise"}) {
    const auto r = run_command({"distort", folder / "x.png", "--out", folder / "out", "--distort", name});
    CHECK(r.code == cli::kUsage);
    CHECK_THAT(r.err, Contains("--distort") && Contains(name));
  }
  CHECK(folder.entries() == 1);
}

TEST_CASE("attack never overwrites what it reads, nor one result with another", "[attack]") {
  const TemporaryFolder folder;
  write_png(folder / "x.png", Tensor<float>({2, 2, 3}));
  const auto own = run_command({"distort", folder / "x.png", "--out", folder.path, "--distort", "blur_1"});
  CHECK(own.code == cli::kUsage);
  CHECK_THAT(own.err, Contains("overwritten"));
  const auto twice = run_command(
      {"distort", folder / "x.png", folder / "x.png", "--out", folder / "out", "--distort", "blur_1"});
  CHECK(twice.code == cli::kUsage);
  CHECK_THAT(twice.err, Contains("two images"));
  const auto missing =
      run_command({"distort", "/no/such.png", "--out", folder / "out", "--distort", "blur_1"});
  CHECK(missing.code == cli::kFailed);
}
