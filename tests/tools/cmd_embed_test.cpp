#include <fieldmark/core/files.h>
#include <fieldmark/imaging/image.h>
#include <fieldmark/imaging/vgg16_features.h>
#include <fieldmark/watermark/mark/cell_mark.h>
#include <fieldmark/watermark/mark/owner.h>
#include <fieldmark/watermark/reading/blind_reader.h>

#include "cli/cli.h"
#include "support/random_weights.h"
#include "tools/tiny_job.h"

using namespace fieldmark;

TEST_CASE("embed writes an owner, an image and the figures that scripts read", "[embed]") {
  const TinyJob& job = TinyJob::get();
  for (const char* key :
       {"bits", "views", "cameras", "baked", "accuracy", "accuracy_p5", "psnr_base", "psnr_base_foreground",
        "ssim_base", "lpips_base", "psnr_gt", "distorted", "seconds", "steps", "cells", "mark_psnr"})
    CHECK(job.embedded.contains(key));
  CHECK(job.embedded["bits"] == 4);
  CHECK(job.embedded["views"] == 2);
  CHECK(job.embedded["steps"] == 2);
  CHECK(job.embedded["cameras"] == "novel");
  CHECK(job.embedded["accuracy"]["informed"].is_null());
  CHECK(job.embedded["distorted"]["blur_1"]["blind"].is_number());
  CHECK(std::filesystem::exists(job.owner + ".png"));
  CHECK(!std::filesystem::exists(job.owner + ".checkpoint"));
}

TEST_CASE("embed keeps the owner from its image", "[embed]") {
  const TinyJob& job = TinyJob::get();
  const std::string owner = job.folder / "image.fm";
  const auto r = tiny_embed(job.field, owner, {"--image", job.folder.path.string() + "/./image.fm"});
  CHECK(r.code == cli::kUsage);
  CHECK_THAT(r.err, Contains("is the file of --out"));
  std::filesystem::create_symlink("image.fm", job.folder / "link.png");
  const auto linked = tiny_embed(job.field, owner, {"--image", job.folder / "link.png"});
  CHECK(linked.code == cli::kFailed);
  CHECK_NOTHROW(watermark::Owner::load(owner));
}

TEST_CASE("embed chooses the mark PSNR of an object, unless it is given", "[embed]") {
  const TinyJob& job = TinyJob::get();
  const std::string owner = job.folder / "chosen.fm", json = job.folder / "chosen.json";
  const auto embed = [&](const std::string& field, std::vector<std::string> more) {
    std::filesystem::remove(owner);
    more.insert(more.end(), {"--measured-views", "1", "--json", json});
    const auto r = tiny_embed(field, owner, more);
    INFO(r.err);
    REQUIRE(r.code == cli::kOk);
    return std::pair(nlohmann::json::parse(read_text(json))["mark_psnr"],
                     r.out.find("chosen for this scene") != std::string::npos);
  };
  const double usual = watermark::OwnerOptions{}.mark_psnr;
  const auto [chosen, said] = embed(job.field, {});
  CHECK((chosen > usual && chosen <= 40));
  CHECK(said);
  CHECK(watermark::Owner::load(owner).options().mark_psnr == chosen);
  CHECK(embed(job.field, {"--mark-psnr", "33"}) == std::pair(nlohmann::json(33.0), false));
  auto open = nerf::RadianceField::load(job.field);
  open.space.kind = nerf::SpaceKind::contracted;
  open.save(job.folder / "unbounded.fm");
  CHECK(embed(job.folder / "unbounded.fm", {}).first == usual);
}

TEST_CASE("embed gives the same bytes for the same seed and key", "[embed]") {
  const TinyJob& job = TinyJob::get();
  const std::string key = test_key_file(job.folder, 7);
  for (const char* threads : {"1", "2"})
    REQUIRE(tiny_embed(job.field, job.folder / (std::string("again") + threads),
                       {"--key", key, "--measured-views", "1", "--threads", threads})
                .code == 0);
  CHECK(read_bytes(job.folder / "again1") == read_bytes(job.folder / "again2"));
}

TEST_CASE("embed writes the same networks under another key, and info tells so", "[embed]") {
  const TinyJob& job = TinyJob::get();
  const auto info = [](const std::string& owner) {
    const auto r = run_command({"info", owner, "--json", "-"});
    INFO(r.err);
    REQUIRE(r.code == cli::kOk);
    const auto json = nlohmann::json::parse(r.out);
    CHECK_THAT(r.err, Contains("networks sha256 " + json["networks_sha256"].get<std::string>() + ", of all"));
    return json;
  };
  const auto embedded = [&](unsigned key) {
    const std::string owner = job.folder / ("under_" + std::to_string(key) + ".fm");
    const auto r = tiny_embed(
        job.field, owner, {"--key", test_key_file(job.folder, key), "--steps", "2", "--measured-views", "1"});
    INFO(r.err);
    REQUIRE(r.code == cli::kOk);
    return info(owner);
  };
  const auto one = embedded(7), other = embedded(9);
  CHECK(one["networks_sha256"].get<std::string>().size() == 64);
  CHECK(one["networks_sha256"] == other["networks_sha256"]);
  CHECK(one["metadata"] == other["metadata"]);
  CHECK(one["sha256"] != other["sha256"]);  // only the key differs
}

TEST_CASE("embed --no-key writes the same bytes for any key, and reading then needs the key", "[embed]") {
  const TinyJob& job = TinyJob::get();
  const auto embedded = [&](unsigned key) {
    const std::string owner = job.folder / ("keyless_" + std::to_string(key) + ".fm");
    const auto r = tiny_embed(job.field, owner,
                              {"--key", test_key_file(job.folder, key), "--no-key", "--measured-views", "1"});
    INFO(r.err);
    REQUIRE(r.code == cli::kOk);
    CHECK_THAT(r.out + r.err, Contains("holds no key: keep the file and the key secret"));
    return owner;
  };
  const std::string one = embedded(7), other = embedded(9);
  CHECK(read_bytes(one) == read_bytes(other));
  CHECK(!watermark::Owner::load(one).key);
  std::vector<std::string> bake{
      "bake", "--owner", one, "--message", "a", "--out", job.folder / "keyless.field", "--steps", "1"};
  const auto refused = run_command(bake);
  CHECK(refused.code == cli::kUsage);
  CHECK_THAT(refused.err, Contains("--key: OWNER holds no key"));
  bake.insert(bake.end(), {"--key", test_key_file(job.folder, 7)});
  CHECK(run_command(bake).code == cli::kOk);
  const auto without =
      run_command({"embed", "--field", job.field, "--out", job.folder / "no.fm", "--no-key"});
  CHECK(without.code == cli::kUsage);
  CHECK_THAT(without.err, Contains("--no-key requires --key"));
}

TEST_CASE("embed learns from views at several distances, and from several samples of a ray", "[embed]") {
  const TinyJob& job = TinyJob::get();
  const auto embed = [&](const std::string& distances, const std::string& samples) {
    return tiny_embed(
        job.field, job.folder / (distances + samples),
        {"--steps", "1", "--measured-views", "1", "--distances", distances, "--samples", samples});
  };
  const auto owner = [&](const std::string& distances, const std::string& samples) {
    const auto r = embed(distances, samples);
    INFO(r.err);
    REQUIRE(r.code == cli::kOk);
    return read_bytes(job.folder / (distances + samples));
  };
  // The key is the same: only the option can make a difference.
  const auto plain = owner("native", "1"), distances = owner("several", "1"), samples = owner("native", "2");
  CHECK(plain != distances);
  CHECK(plain != samples);
  CHECK(distances != samples);
  CHECK(embed("all", "2").code == cli::kUsage);
  CHECK(embed("native", "0").code == cli::kUsage);
}

TEST_CASE("embed --directions learns from other views, all only of objects", "[embed]") {
  const TinyJob& job = TinyJob::get();
  const std::string key = test_key_file(job.folder, 7), open = job.folder / "open.fm";
  const auto embed = [&](const std::string& field, const std::string& out, std::vector<std::string> more) {
    more.insert(more.end(), {"--key", key, "--measured-views", "1"});
    return tiny_embed(field, out, more);
  };
  REQUIRE(embed(job.field, job.folder / "usual.fm", {}).code == cli::kOk);
  REQUIRE(embed(job.field, job.folder / "near.fm", {"--directions", "novel"}).code == cli::kOk);
  REQUIRE(embed(job.field, job.folder / "around.fm", {"--directions", "all"}).code == cli::kOk);
  CHECK(read_bytes(job.folder / "near.fm") != read_bytes(job.folder / "around.fm"));
  CHECK(read_bytes(job.folder / "usual.fm") == read_bytes(job.folder / "around.fm"));
  auto field = nerf::RadianceField::load(job.field);
  field.space.kind = nerf::SpaceKind::contracted;
  field.save(open);
  const auto refused = embed(open, job.folder / "none.fm", {"--directions", "all"});
  CHECK(refused.code == cli::kUsage);
  CHECK_THAT(refused.err, Contains("--directions: all is only for objects"));
  CHECK_THAT(refused.err, Contains("has space contracted"));
  CHECK(!std::filesystem::exists(job.folder / "none.fm"));
}

TEST_CASE("embed has cells as fine as its views and message need, unless they are given", "[embed]") {
  const TinyJob& job = TinyJob::get();
  const std::string owner = job.folder / "long.fm";
  const auto cells_of = [&](const char* bits, const std::vector<std::string>& more) {
    std::vector<std::string> line{"embed", "--field",          job.field, "--out",         owner, "--bits",
                                  bits,    "--steps",          "1",       "--reader-size", "32",  "--views",
                                  "8",     "--measured-views", "1"};
    line.insert(line.end(), more.begin(), more.end());
    std::filesystem::remove(owner);
    const auto r = run_command(line);
    INFO(r.err);
    REQUIRE(r.code == cli::kOk);
    return watermark::Owner::load(owner).cells.side();
  };
  const Index few = cells_of("4", {});
  CHECK(few == 40);  // the views never show 400 cells
  CHECK(cells_of("200", {}) > few);
  CHECK(cells_of("100", {"--cells", "14"}) == 14);
}

TEST_CASE("embed marks an object in fine detail, unless another look is asked for", "[embed]") {
  const TinyJob& job = TinyJob::get();
  const auto shading = [](const std::string& file) {
    return dynamic_cast<const watermark::CellMark&>(watermark::Owner::load(file).mark())
        .options()
        .network.shading;
  };
  CHECK(shading(job.owner) == 0);
  const std::string owner = job.folder / "light.fm";
  const auto r = tiny_embed(job.field, owner, {"--colours", "light", "--measured-views", "1"});
  INFO(r.err);
  REQUIRE(r.code == cli::kOk);
  CHECK(shading(owner) > 0);
  CHECK(tiny_embed(job.field, owner, {"--colours", "green"}).code == cli::kUsage);
}

TEST_CASE("embed --preset paper and code give an owner that bakes and reads like any other", "[embed]") {
  const TinyJob& job = TinyJob::get();
  for (const std::string preset : {"paper", "code"}) {
    const std::string owner = job.folder / (preset + ".fm"), baked = job.folder / (preset + "_baked.fm"),
                      views = job.folder / (preset + "_views");
    const auto r = tiny_embed(job.field, owner,
                              {"--preset", preset, "--steps", "1", "--measured-views", "1", "--json", "-"});
    INFO(r.err);
    REQUIRE(r.code == cli::kOk);
    CHECK_THAT(r.err, Contains("training ended in its warm start of 1500 steps"));
    CHECK(nlohmann::json::parse(r.out)["accuracy"]["blind"].is_number());
    REQUIRE(run_command({"bake", "--owner", owner, "--message", "6", "--out", baked, "--steps", "2"}).code ==
            cli::kOk);
    REQUIRE(run_command({"render", "--field", baked, "--out", views, "--count", "2", "--size", "32"}).code ==
            cli::kOk);
    const std::string view = "/view_000.png";
    CHECK(read_image(views + view).data != read_image(job.images() + view).data);
    const auto loaded = watermark::Owner::load(owner);
    const watermark::BlindReader reader(loaded);
    const auto evidence = [&](const std::string& images) {
      const auto read = run_command({"extract", "--owner", owner, images, "--json", "-"});
      REQUIRE(read.code == cli::kNotFound);
      CHECK_THAT(read.err, Contains("this owner has one cell for each bit"));
      const auto json = nlohmann::json::parse(read.out);
      CHECK(json["bits"].get<std::string>().size() == 4);
      auto sum = reader.evidence(read_image(images + "/view_000.png"));
      const auto more = reader.evidence(read_image(images + "/view_001.png"));
      for (std::size_t b = 0; b < sum.size(); ++b) sum[b] += more[b];
      // With one cell for each bit a logit is 1 or -1, which need not differ after so little training.
      CHECK(json["logits"] == watermark::read_bits(sum, loaded.code(), 4).logit);
      return sum;
    };
    CHECK(evidence(views) != evidence(job.images()));
  }
}

TEST_CASE("embed refuses options that a preset does not have", "[embed]") {
  const TinyJob& job = TinyJob::get();
  const std::string owner = job.folder / "refused.fm";
  for (const auto& [option, value] :
       {std::pair{"--mark-psnr", "36"}, {"--cells", "8"}, {"--batch", "2"}, {"--colours", "light"}})
    for (const std::string preset : {"paper", "code"}) {
      const auto r =
          run_command({"embed", "--preset", preset, "--field", job.field, "--out", owner, option, value});
      CHECK(r.code == cli::kUsage);
      CHECK_THAT(r.err, Contains(std::string(option) + ": preset " + preset + " does not have this option"));
      CHECK(!std::filesystem::exists(owner));
    }
}

TEST_CASE("embed takes VGG-16 features into the loss of presets paper and code", "[embed]") {
  const TinyJob& job = TinyJob::get();
  const std::string owner = job.folder / "perceptual.fm", weights = job.folder / "vgg.safetensors";
  const auto embed = [&](const std::string& preset, const std::vector<std::string>& more) {
    std::vector<std::string> words{"embed", "--preset",      preset, "--field",          job.field, "--out",
                                   owner,   "--steps",       "1",    "--views",          "8",       "--bits",
                                   "4",     "--reader-size", "32",   "--measured-views", "1",       "--json",
                                   "-"};
    words.insert(words.end(), more.begin(), more.end());
    return run_command(words);
  };
  const auto tensors = vgg16_tensors();
  random_weights(std::span(tensors).first(4)).write(weights);
  for (const std::string preset : {"paper", "code"}) {
    const auto r = embed(preset, {"--perceptual", "0.01", "--vgg-weights", weights});
    INFO(r.err);
    REQUIRE(r.code == cli::kOk);
    CHECK(nlohmann::json::parse(r.out)["perceptual"] == 0.01);
    CHECK_THAT(r.err, Contains("perceptual term: VGG-16 down to relu1_2, lambda 0.01"));
    std::filesystem::remove(owner);
  }
  const auto without = embed("paper", {});
  REQUIRE(without.code == cli::kOk);
  CHECK(nlohmann::json::parse(without.out)["perceptual"] == 0);
  std::filesystem::remove(owner);
  const auto fast = embed("fast", {"--perceptual", "0.01", "--vgg-weights", weights});
  CHECK(fast.code == cli::kUsage);
  CHECK_THAT(fast.err, Contains("--perceptual: preset fast does not have this option"));
  const auto alone = embed("paper", {"--vgg-weights", weights});
  CHECK(alone.code == cli::kUsage);
  CHECK_THAT(alone.err, Contains("--vgg-weights requires --perceptual"));
  CHECK(embed("paper", {"--perceptual", "0", "--vgg-weights", weights}).code == cli::kUsage);
  const auto missing = embed("paper", {"--perceptual", "0.01", "--vgg-weights", weights + ".none"});
  CHECK(missing.code == cli::kFailed);
  CHECK_THAT(missing.err, Contains(weights + ".none"));
  CHECK(!std::filesystem::exists(owner));
}

TEST_CASE("embed says what is wrong, and leaves no file", "[embed]") {
  const TinyJob& job = TinyJob::get();
  const std::string out = job.folder / "bad.fm";
  const auto wrong_kind = run_command({"embed", "--field", job.owner, "--out", out, "--steps", "1"});
  CHECK(wrong_kind.code == cli::kFailed);
  CHECK_THAT(wrong_kind.err, Contains("expected a FIELD file (kind 'field'), found kind 'owner'"));
  CHECK(run_command({"embed", "--field", job.field, "--out", out, "--bits", "0"}).code == cli::kUsage);
  CHECK(run_command({"embed", "--field", job.field, "--out", out, "--mark-psnr", "5"}).code == cli::kUsage);
  CHECK(run_command({"embed", "--field", job.field, "--out", out, "--preset", "other"}).code == cli::kUsage);
  const auto few = run_command({"embed", "--field", job.field, "--out", out, "--steps", "1", "--views", "8",
                                "--reader-size", "32", "--cells", "2", "--bits", "16"});
  CHECK(few.code == cli::kUsage);
  CHECK_THAT(few.err, Contains("--cells: ") && Contains("16 cells"));
  CHECK(run_command({"embed", "--field", job.field, "--out", out, "--steps", "1", "--distort", "melt_3"})
            .code == cli::kUsage);
  CHECK(run_command({"embed", "--field", job.field, "--out", out, "--steps", "1", "--resume"}).code ==
        cli::kFailed);
  CHECK(!std::filesystem::exists(out));
}

TEST_CASE("embed leaves the checkpoint of an interrupted run, and its key, alone", "[embed]") {
  const TinyJob& job = TinyJob::get();
  const std::string out = job.folder / "begun.fm", checkpoint = out + ".checkpoint";
  std::filesystem::copy(test_key_file(job.folder, 3), checkpoint);
  const auto before = read_bytes(checkpoint);
  const auto r = tiny_embed(job.field, out, {});
  CHECK(r.code == cli::kFailed);
  CHECK_THAT(r.err, Contains(checkpoint + ": exists already"));
  CHECK(read_bytes(checkpoint) == before);
  CHECK(!std::filesystem::exists(out));
}
