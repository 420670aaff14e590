#include <fieldmark/core/files.h>
#include <fieldmark/imaging/image.h>
#include <fieldmark/nerf/dataset.h>
#include <fieldmark/nerf/radiance_field.h>
#include <fieldmark/nerf/trainer.h>
#include <fieldmark/watermark/mark/owner.h>

#include <csignal>
#include <nlohmann/json.hpp>

#include "cli/cli.h"
#include "support/catch.h"
#include "support/temporary_folder.h"
#include "tools/run_command.h"
#include "tools/tiny_job.h"
#include "tools/tiny_scene.h"

using namespace fieldmark;

TEST_CASE("train writes a field, its figures, and the same bytes for one and two threads", "[train]") {
  const TemporaryFolder folder;
  const std::string scene = tiny_scene(folder);
  const auto train = [&](const std::string& out, const char* threads) {
    return run_command({"train", "--data", scene, "--out", folder / out, "--steps", "6", "--threads", threads,
                        "--json", "-"});
  };
  const auto r = train("a.fm", "1");
  INFO(r.err);
  REQUIRE(r.code == cli::kOk);
  const nlohmann::json json = nlohmann::json::parse(r.out);
  for (const char* key : {"test_psnr", "test_psnr_foreground", "train_seconds", "steps", "samples_per_second",
                          "parameters", "file_bytes"})
    CHECK(json.at(key).is_number());
  CHECK(json["steps"] == 6);
  CHECK(json["replanned"] == false);
  CHECK(json["file_bytes"] == std::filesystem::file_size(folder / "a.fm"));
  CHECK(!std::filesystem::exists(folder / "a.fm.checkpoint"));
  REQUIRE(train("b.fm", "2").code == cli::kOk);
  CHECK(read_bytes(folder / "a.fm") == read_bytes(folder / "b.fm"));
}

TEST_CASE("train tells that there are no test images, and writes the field", "[train]") {
  const TemporaryFolder folder;
  const std::string scene = tiny_scene(folder);
  std::filesystem::remove_all(std::filesystem::path(scene) / "test");  // the JSON stays, as of BlenderNeRF
  const auto r = run_command(
      {"train", "--data", scene, "--out", folder / "f.fm", "--steps", "1", "--json", folder / "f.json"});
  INFO(r.err);
  REQUIRE(r.code == cli::kOk);
  CHECK_THAT(r.out + r.err, Contains("has no test images, so no PSNR is measured on them"));
  CHECK(nlohmann::json::parse(read_text(folder / "f.json"))["test_psnr"].is_null());
}

TEST_CASE("train tells that the field is complete if a test image cannot be read", "[train]") {
  const TemporaryFolder folder;
  const std::string scene = tiny_scene(folder), out = folder / "f.fm";
  const auto first = std::filesystem::directory_iterator(std::filesystem::path(scene) / "test")->path();
  write_file_atomically(first, "not an image");
  const auto r = run_command({"train", "--data", scene, "--out", out, "--steps", "1"});
  CHECK(r.code == cli::kFailed);
  CHECK_THAT(r.err, Contains(out + " is complete, but its test views cannot be measured: ") &&
                        Contains(first.filename().string()));
  CHECK_NOTHROW(nerf::RadianceField::load(out));
}

TEST_CASE("train says what type of scene it sees, and takes another that is asked for", "[train]") {
  const TemporaryFolder folder;
  const std::string scene = tiny_scene(folder), out = folder / "f.fm";
  const auto train = [&](std::vector<std::string> more) {
    std::vector<std::string> words{"train", "--data", scene, "--out", out, "--steps", "2", "--json", "-"};
    words.insert(words.end(), more.begin(), more.end());
    return run_command(words);
  };
  const auto seen = train({});
  INFO(seen.err);
  REQUIRE(seen.code == cli::kOk);
  CHECK_THAT(seen.err,
             Contains("scene type object: 100% of the pixels at the images' borders are transparent; "
                      "--scene-type overrides"));
  const nlohmann::json json = nlohmann::json::parse(seen.out);
  CHECK(json["scene_type"] == "object");
  CHECK(json["scene_type_reason"] == "100% of the pixels at the images' borders are transparent");
  const auto place = train({"--scene-type", "place"});
  REQUIRE(place.code == cli::kOk);
  CHECK(nlohmann::json::parse(place.out)["scene_type"] == "place");
  CHECK_THAT(place.err, Contains("scene type place: as asked for\n") && !Contains("silhouettes"));
  CHECK_THAT(train({"--scene-type", "place", "--no-carve"}).err,
             Contains("--no-carve: only objects have silhouettes"));
  CHECK(nerf::RadianceField::load(out).space.kind == nerf::SpaceKind::contracted);
  for (const char* wrong : {"forward", "plain", "room"}) {
    const auto refused = train({"--scene-type", wrong});
    CHECK(refused.code == cli::kUsage);
    CHECK_THAT(refused.err, Contains("--scene-type"));
  }
}

TEST_CASE("train ends with an error where there is nothing to learn, and writes no field", "[train]") {
  const TemporaryFolder folder;
  const std::string scene = tiny_scene(folder), out = folder / "f.fm";
  for (const auto& image : std::filesystem::directory_iterator(std::filesystem::path(scene) / "train"))
    write_png(image.path(), Tensor<float>({16, 16, 4}));
  const auto r = run_command({"train", "--data", scene, "--out", out, "--steps", "500"});
  CHECK(r.code == cli::kFailed);
  CHECK_THAT(r.err, Contains("training collapsed after ") &&
                        Contains(" steps: no cell of the scene is occupied") &&
                        Contains("taken for type object") && Contains("--scene-type"));
  CHECK(!std::filesystem::exists(out));
}

TEST_CASE("train --supersampling makes a field that is rendered so", "[train]") {
  const TemporaryFolder folder;
  const std::string scene = tiny_scene(folder), out = folder / "f.fm";
  const auto r =
      run_command({"train", "--data", scene, "--out", out, "--supersampling", "2", "--steps", "2"});
  INFO(r.err);
  REQUIRE(r.code == cli::kOk);
  const auto eval = [&](std::vector<std::string> more) {
    std::vector<std::string> words{"eval", "--field", out, "--data", scene, "--json", "-"};
    words.insert(words.end(), more.begin(), more.end());
    return nlohmann::json::parse(run_command(words).out);
  };
  const nlohmann::json as_trained = eval({}), finer = eval({"--supersampling", "2"}),
                       centres = eval({"--supersampling", "1"});
  CHECK(as_trained["supersampling"] == 2);
  CHECK(as_trained["psnr"] == finer["psnr"]);
  CHECK(as_trained["psnr"] != centres["psnr"]);
  const auto three = run_command({"train", "--data", scene, "--out", out, "--supersampling", "3"});
  CHECK(three.code == cli::kUsage);
  const auto mlp =
      run_command({"train", "--data", scene, "--out", out, "--supersampling", "2", "--preset", "mlp"});
  CHECK(mlp.code == cli::kUsage);
  CHECK_THAT(mlp.err, Contains("--supersampling: the mlp preset"));
}

TEST_CASE("train --preset mlp writes a field whose points a ray render can choose", "[train]") {
  const TemporaryFolder folder;
  const std::string scene = tiny_scene(folder), out = folder / "f.fm";
  const auto r =
      run_command({"train", "--data", scene, "--out", out, "--preset", "mlp", "--steps", "1", "--json", "-"});
  INFO(r.err);
  REQUIRE(r.code == cli::kOk);
  CHECK(nlohmann::json::parse(r.out)["parameters"] == 2 * 595844);
  const auto info = run_command({"info", out});
  CHECK_THAT(info.out, Contains("\"kind\": \"mlp\"") && Contains("coarse/density/0/weight"));
  const auto render = [&](const std::string& field, const char* to, std::vector<std::string> more) {
    std::vector<std::string> words{"render",  "--field", field,    "--out", folder / to,
                                   "--count", "1",       "--size", "8"};
    words.insert(words.end(), more.begin(), more.end());
    return run_command(words);
  };
  CHECK(render(out, "trained", {}).code == cli::kOk);
  CHECK(render(out, "random", {"--average", "0", "--importance", "0", "--random", "6"}).code == cli::kOk);
  CHECK(read_bytes(folder / "trained/view_000.png") != read_bytes(folder / "random/view_000.png"));
  const auto none = render(out, "none", {"--average", "0"});
  CHECK(none.code == cli::kUsage);
  CHECK_THAT(none.err, Contains("--average 0: needs --random N"));
  CHECK(render(out, "many", {"--importance", "1025"}).code == cli::kUsage);
  const auto hash = render(tiny_field(folder, scene), "hash", {"--importance", "8"});
  CHECK(hash.code == cli::kUsage);
  CHECK_THAT(hash.err, Contains("only for fields trained with --preset mlp"));
}

TEST_CASE("train says what is wrong with its data and its options, and leaves no file", "[train]") {
  const TemporaryFolder folder;
  const std::string out = folder / "f.fm";
  const auto missing = run_command({"train", "--data", "/no/such/scene", "--out", out, "--steps", "1"});
  CHECK(missing.code == cli::kFailed);
  CHECK_THAT(missing.err, Contains("/no/such/scene"));
  CHECK(run_command({"train", "--data", "x", "--out", out, "--steps", "1", "--seconds", "2"}).code ==
        cli::kUsage);
  CHECK(run_command({"train", "--data", "x", "--out", out, "--steps", "0"}).code == cli::kUsage);
  CHECK(run_command({"train", "--data", "x"}).code == cli::kUsage);
  const std::string scene = tiny_scene(folder);
  const auto small =
      run_command({"train", "--data", scene, "--out", out, "--steps", "1", "--max-megabytes", "0.1"});
  CHECK(small.code == cli::kUsage);
  CHECK_THAT(small.err, Contains("--max-megabytes: no field is as small as 0.1"));
  CHECK(run_command({"train", "--data", scene, "--out", out, "--steps", "1", "--no-carve", "--refine-poses"})
            .code == cli::kUsage);
  const auto place = run_command(
      {"train", "--data", scene, "--out", out, "--steps", "1", "--preset", "mlp", "--scene-type", "place"});
  CHECK(place.code == cli::kUsage);
  CHECK_THAT(place.err, Contains("--preset mlp: ") && Contains("use --preset hash"));
  const TinyJob& job = TinyJob::get();
  std::filesystem::copy(job.owner, folder / "f.fm.checkpoint");
  const auto kept = run_command({"train", "--data", scene, "--out", out, "--steps", "1"});
  CHECK(kept.code == cli::kFailed);
  CHECK_THAT(kept.err, Contains("f.fm.checkpoint: exists already") && Contains("--resume"));
  CHECK_NOTHROW(watermark::Owner::load(folder / "f.fm.checkpoint"));
  std::filesystem::remove(folder / "f.fm.checkpoint");
  const auto nothing = run_command({"train", "--data", scene, "--out", out, "--steps", "2", "--resume"});
  CHECK(nothing.code == cli::kFailed);
  CHECK_THAT(nothing.err, Contains("f.fm.checkpoint"));
  CHECK(run_command({"train", "--data", scene, "--out", "/no/folder/f", "--steps", "1"}).code ==
        cli::kFailed);
  CHECK(!std::filesystem::exists(out));
}

TEST_CASE(
    "train sizes the model from the scene, says what it tried, and stops where held-out views look as wanted",
    "[train]") {
  const TemporaryFolder folder;
  const std::string scene = folder / "scene";
  REQUIRE(run_command({"scene", "--out", scene, "--kind", "sphere", "--size", "32", "--views", "8"}).code ==
          0);
  const auto r = run_command({"train", "--data", scene, "--out", folder / "sized.fm", "--model", "sized",
                              "--steps", "2000", "--target-psnr", "12", "--json", "-"});
  INFO(r.err);
  REQUIRE(r.code == cli::kOk);
  const nlohmann::json json = nlohmann::json::parse(r.out);
  CHECK(json["steps"] == 250);  // the first evaluation of the held-out views
  REQUIRE(json["sizing"]["trials"].size() >= 3);
  CHECK(json["sizing"]["trials"][0]["taken"] == true);
  CHECK(json["file_bytes"].get<double>() < 1e6);
  CHECK(run_command(
            {"train", "--data", scene, "--out", folder / "no.fm", "--model", "sized", "--preset", "mlp"})
            .code == cli::kUsage);

  // A third of a second ends before any tables have been compared.
  const auto short_run = run_command({"train", "--data", scene, "--out", folder / "short.fm", "--model",
                                      "sized", "--seconds", "1", "--json", "-"});
  INFO(short_run.err);
  REQUIRE(short_run.code == cli::kOk);
  const nlohmann::json unknown = nlohmann::json::parse(short_run.out)["sizing"];
  CHECK(unknown["trials"].size() <= 2);
  CHECK(unknown["log2_table"] == nerf::field_options({.seconds = 1}).field.encoding.log2_table);
}

TEST_CASE("train --model sized goes on with the sizes of its checkpoint", "[train]") {
  const TemporaryFolder folder;
  const std::string scene = tiny_scene(folder);
  nerf::RadianceFieldOptions small{.seed = 1};
  small.field.encoding.log2_table = 6;
  nerf::RadianceField field(small);
  auto options = nerf::train_options(nerf::FieldKind::hash);
  options.schedule.steps = 4;
  options.seed = 1;
  const auto data = nerf::load_dataset(scene, {.split = "train"});
  nerf::Trainer trainer(field, data, options);
  trainer.step(0);
  trainer.save(folder / "f.fm.checkpoint");
  const auto r = run_command({"train", "--data", scene, "--out", folder / "f.fm", "--model", "sized",
                              "--resume", "--steps", "4", "--json", "-"});
  INFO(r.err);
  REQUIRE(r.code == cli::kOk);
  CHECK(nlohmann::json::parse(r.out)["parameters"] == field.params.parameters());
  CHECK(!nlohmann::json::parse(r.out).contains("sizing"));
}
