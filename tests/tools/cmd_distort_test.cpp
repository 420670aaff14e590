#include <fieldmark/core/files.h>
#include <fieldmark/imaging/image.h>

#include <nlohmann/json.hpp>

#include "cli/cli.h"
#include "imaging/video/video_samples.h"
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

TEST_CASE("distort keeps runs apart: a folder that has images only with --overwrite", "[attack]") {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder / "out");
  write_png(folder / "x.png", Tensor<float>({4, 4, 3}, 0.5f));
  write_png(folder / "out/x.png", Tensor<float>({2, 2, 3}));
  write_png(folder / "out/y.png", Tensor<float>({2, 2, 3}));
  const auto distort = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"distort", folder / "x.png", "--out", folder / "out", "--distort", "mirror"});
    return run_command(more);
  };
  const auto refused = distort({});
  CHECK(refused.code == cli::kFailed);
  CHECK_THAT(refused.err, Contains("expected a folder without images, found 2") && Contains("--overwrite"));
  CHECK(read_image(folder / "out/x.png").shape == Shape{2, 2, 3});
  const auto replaced = distort({"--overwrite"});
  CHECK(replaced.code == cli::kOk);
  CHECK_THAT(replaced.out, Contains("images of other names stay beside the new ones: 1"));
  CHECK(read_image(folder / "out/x.png").shape == Shape{4, 4, 3});
  CHECK(read_image(folder / "out/y.png").shape == Shape{2, 2, 3});
}

TEST_CASE("distort takes the images of a folder as a clip for h264", "[attack]") {
  if (!video_or_skip()) return;
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder / "in");
  for (int k = 0; k < 4; ++k) write_png(folder / ("in/r_" + std::to_string(k) + ".png"), clip_frame(k));
  write_file_atomically(folder / "in/r_2b.png", std::string_view("no image"));
  const auto distort = [&](const std::string& out, const std::string& name) {
    return run_command({"distort", folder / "in", "--out", folder / out, "--distort", name, "--json", "-"});
  };
  const auto r = distort("a", "noise_0,h264_5,noise_0.1,h264_0,noise_0");
  INFO(r.err);
  CHECK(r.code == cli::kFailed);  // because of the broken file
  const auto json = nlohmann::json::parse(r.out);
  REQUIRE(json["images"].size() == 4);
  CHECK(json["images"][3]["out"] == (folder / "a/r_3.png").string());
  distort("b", "h264_5");
  for (int k = 0; k < 4; ++k)
    CHECK(part_difference(read_image(folder / ("b/r_" + std::to_string(k) + ".png")), clip_frame(k)) < 0.04);
  // The random draws of a chain depend on the position of the step, with or without a clip among the steps.
  distort("c", "h264_0,noise_0.1"), distort("d", "noise_0,noise_0.1");
  const auto c = read_image(folder / "c/r_1.png"), d = read_image(folder / "d/r_1.png");
  CHECK(part_difference(c, d) < 0.03);
  write_png(folder / "in/r_9.png", Tensor<float>({8, 8, 3}, 0.5f));
  const auto mixed = distort("e", "h264_20");
  CHECK(mixed.code == cli::kFailed);
  CHECK_THAT(mixed.err, Contains("r_9.png: expected an image of 32 x 16 pixels"));
  CHECK(std::filesystem::is_empty(folder / "e"));
}
