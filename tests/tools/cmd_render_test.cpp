#include <fieldmark/core/files.h>
#include <fieldmark/imaging/image.h>
#include <fieldmark/imaging/video/video_reader.h>
#include <fieldmark/nerf/renderer.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "cli/cli.h"
#include "support/catch.h"
#include "support/temporary_folder.h"
#include "support/worst.h"
#include "tools/run_command.h"
#include "tools/tiny_job.h"
#include "tools/tiny_scene.h"

using namespace fieldmark;

namespace {
// Returns the largest difference of a number in two images of one shape.
double farthest_apart(const Tensor<float>& a, const Tensor<float>& b) {
  REQUIRE(a.shape == b.shape);
  double farthest = 0;
  for (Index i = 0; i < a.size(); ++i) raise_to(farthest, std::abs(static_cast<double>(a[i] - b[i])));
  return farthest;
}
}  // namespace

TEST_CASE("render draws cameras from the field alone, or takes a data set's", "[render]") {
  const TemporaryFolder folder;
  const std::string scene = tiny_scene(folder), field = tiny_field(folder, scene);
  const auto loaded = nerf::RadianceField::load(field);
  nerf::Renderer renderer(loaded);
  for (const char* cameras : {"novel", "ring", "sphere", "extrapolated", "closer", "farther"}) {
    const auto r = run_command({"render", "--field", field, "--out", folder / cameras, "--cameras", cameras,
                                "--count", "2", "--size", "12", "--json", "-"});
    INFO(r.err);
    REQUIRE(r.code == cli::kOk);
    const nlohmann::json json = nlohmann::json::parse(r.out);
    CHECK(json["views"] == 2);
    REQUIRE(json["images"].size() == 2);
    const auto drawn = nerf::make_cameras(loaded.cameras, nerf::parse_camera_set(cameras), 2, 12, 1);
    for (std::size_t i = 0; i < 2; ++i)
      CHECK(farthest_apart(read_image(json["images"][i].get<std::string>()), renderer.render(drawn[i]).rgb) <
            0.51 / 255);
  }
  CHECK(read_image(folder / "novel/view_000.png").data != read_image(folder / "sphere/view_000.png").data);
  REQUIRE(run_command({"render", "--field", field, "--out", folder / "fine", "--count", "2", "--size", "12",
                       "--supersampling", "3"})
              .code == cli::kOk);
  CHECK(read_image(folder / "fine/view_000.png").shape == Shape{12, 12, 3});
  CHECK(read_image(folder / "fine/view_000.png").data != read_image(folder / "novel/view_000.png").data);
  const auto data = run_command({"render", "--field", field, "--out", folder / "data", "--data", scene,
                                 "--against", field, "--sheet", folder / "sheet.png"});
  REQUIRE(data.code == cli::kOk);
  CHECK(read_image(folder / "data/r_0.png").shape == Shape{16, 16, 3});
  CHECK(read_image(folder / "sheet.png").shape[1] == 3 * 16 + 2 * 4);
}

TEST_CASE("render keeps views of another run apart, or removes them on demand", "[render]") {
  const TemporaryFolder folder;
  const std::string field = tiny_field(folder, tiny_scene(folder)), out = folder / "v";
  const auto render = [&](std::vector<std::string> more) {
    std::vector<std::string> words{"render", "--field", field, "--out", out, "--size", "8"};
    words.insert(words.end(), more.begin(), more.end());
    return run_command(words);
  };
  REQUIRE(render({"--count", "3"}).code == cli::kOk);
  const Outcome refused = render({"--count", "2"});
  CHECK(refused.code == cli::kFailed);
  CHECK_THAT(refused.err,
             Contains(out + ": expected a folder without images, found 3") && Contains("--overwrite"));
  CHECK(std::filesystem::exists(out + "/view_002.png"));
  write_png(out + "/holiday.png", Tensor<float>({1, 1, 3}));
  const Outcome over = render({"--count", "2", "--overwrite"});
  CHECK(over.code == cli::kOk);
  CHECK_THAT(over.out, Contains("images of other names stay beside the new views: 1"));
  CHECK(std::filesystem::exists(out + "/view_001.png"));
  CHECK(!std::filesystem::exists(out + "/view_002.png"));
  CHECK(std::filesystem::exists(out + "/holiday.png"));
}

TEST_CASE("render fails if an image cannot be written, the first or the last, by any number of threads",
          "[render]") {
  const TemporaryFolder folder;
  const std::string field = tiny_field(folder, tiny_scene(folder));
  for (const std::string number : {"000", "002"})
    for (const std::string threads : {"1", "2"}) {
      CAPTURE(number, threads);
      const std::string out = folder / ("v" + number + threads), image = out + "/view_" + number + ".png";
      std::filesystem::create_directories(image + "/in_the_way");
      const Outcome r = run_command({"render", "--field", field, "--out", out, "--size", "8", "--count", "3",
                                     "--threads", threads, "--json", "-"});
      CHECK(r.code == cli::kFailed);
      CHECK_THAT(r.err, Contains(image));
      CHECK(r.out.empty());
      CHECK(std::filesystem::is_regular_file(out + "/view_001.png") == (number == "002"));
    }
}

TEST_CASE("render writes no two views to one file", "[render]") {
  const TinyJob& job = TinyJob::get();
  const TemporaryFolder folder;
  std::filesystem::copy(job.scene, folder / "scene", std::filesystem::copy_options::recursive);
  const std::string poses = folder / "scene/transforms_test.json";
  auto json = nlohmann::json::parse(read_text(poses));
  REQUIRE(json["frames"].size() > 1);
  const std::string first = json["frames"][0]["file_path"],
                    name = std::filesystem::path(first).filename().string();
  std::filesystem::create_directory(folder / "scene/again");
  std::filesystem::copy(folder / ("scene/" + first + ".png"), folder / ("scene/again/" + name + ".png"));
  json["frames"][1]["file_path"] = "again/" + name;
  write_file_atomically(poses, json.dump());
  const auto r =
      run_command({"render", "--field", job.field, "--out", folder / "views", "--data", folder / "scene"});
  CHECK(r.code == cli::kFailed);
  CHECK_THAT(r.err, Contains("found two called '" + name + "'"));
  CHECK(!std::filesystem::exists(folder / "views"));
}

TEST_CASE("render refuses options that contradict each other", "[render]") {
  const auto with = [](std::vector<std::string> more) {
    std::vector<std::string> words{"render", "--field", "f", "--out", "o"};
    words.insert(words.end(), more.begin(), more.end());
    return run_command(words).code;
  };
  CHECK(with({"--count", "2", "--data", "d"}) == cli::kUsage);
  CHECK(with({"--sheet", "s.png"}) == cli::kUsage);
  CHECK(with({"--split", "val"}) == cli::kUsage);
  CHECK(with({"--cameras", "circle"}) == cli::kUsage);
  CHECK(with({"--cameras", "ring", "--data", "d"}) == cli::kUsage);
  CHECK(with({"--count", "0"}) == cli::kUsage);
  CHECK(with({}) == cli::kFailed);
  const TinyJob& job = TinyJob::get();
  const auto test =
      run_command({"render", "--field", job.field, "--out", job.folder / "of_test", "--cameras", "test"});
  CHECK(test.code == cli::kUsage);
  CHECK_THAT(test.err, Contains("--cameras test: needs --data DIR"));
  const auto split = run_command(
      {"render", "--field", "f", "--out", "o", "--data", "d", "--cameras", "test", "--split", "train"});
  CHECK(split.code == cli::kUsage);
  CHECK_THAT(split.err, Contains("--split train: --cameras test renders the test views"));
  const std::string kept = job.images() + "/view_000.png";
  CHECK(run_command({"render", "--field", job.field, "--out", job.images(), "--overwrite", "--average", "8"})
            .code == cli::kUsage);
  CHECK(std::filesystem::exists(kept));
}

TEST_CASE("render follows an orbit or a file, into a folder or a video", "[render]") {
  const TemporaryFolder folder;
  const std::string field = tiny_field(folder, tiny_scene(folder));
  const auto render = [&](std::vector<std::string> more) {
    std::vector<std::string> words{"render", "--field", field, "--size", "16", "--json", "-"};
    words.insert(words.end(), more.begin(), more.end());
    return run_command(words);
  };
  const Outcome orbit = render({"--path", "orbit", "--count", "3", "--out", folder / "orbit"});
  INFO(orbit.err);
  REQUIRE(orbit.code == cli::kOk);
  CHECK(nlohmann::json::parse(orbit.out)["images"].size() == 3);
  CHECK(read_image(folder / "orbit/view_000.png").data != read_image(folder / "orbit/view_001.png").data);

  write_file_atomically(folder / "path.json",
                        R"({"frames": [{"transform_matrix": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 4]]}]})");
  const Outcome file = render({"--path", folder / "path.json", "--out", folder / "file"});
  REQUIRE(file.code == cli::kOk);
  CHECK(nlohmann::json::parse(file.out)["views"] == 1);
  const auto loaded = nerf::RadianceField::load(field);
  nerf::Renderer renderer(loaded);
  nerf::Camera camera = nerf::make_cameras(loaded.cameras, nerf::CameraSet::ring, 1, 16, 1).front();
  camera.pose = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 4};
  CHECK(farthest_apart(read_image(folder / "file/view_000.png"), renderer.render(camera).rgb) < 0.51 / 255);

  const Outcome video = render({"--path", "orbit", "--count", "4", "--fps", "12", "--out", folder / "v.mp4"});
  if (has_video()) {
    REQUIRE(video.code == cli::kOk);
    CHECK(nlohmann::json::parse(video.out)["images"] == nlohmann::json::array({folder / "v.mp4"}));
    VideoReader reader(folder / "v.mp4");
    CHECK(reader.next()->image.shape == Shape{16, 16, 3});
  } else {
    CHECK(video.code == cli::kFailed);
    CHECK_THAT(video.err, Contains("H.264"));
  }
}

TEST_CASE("render keeps opacity and depth on demand, and --overwrite removes them", "[render]") {
  const TemporaryFolder folder;
  const std::string field = tiny_field(folder, tiny_scene(folder)), out = folder / "v";
  REQUIRE(run_command({"render", "--field", field, "--out", out, "--size", "16", "--count", "2", "--alpha",
                       "--depth"})
              .code == cli::kOk);
  const Tensor<float> image = read_image(out + "/view_001.png");
  REQUIRE(image.shape == Shape{16, 16, 4});
  CHECK(image.data[3] == 0);                       // a corner
  CHECK(image.data[4 * (8 * 16 + 8) + 3] > 0.9f);  // the middle
  CHECK(std::filesystem::file_size(out + "/view_001_depth.npy") == 128 + 4 * 16 * 16);
  REQUIRE(
      run_command({"render", "--field", field, "--out", out, "--size", "16", "--count", "2", "--overwrite"})
          .code == cli::kOk);
  CHECK(!std::filesystem::exists(out + "/view_001_depth.npy"));
  CHECK(read_image(out + "/view_001.png").shape == Shape{16, 16, 3});
}

TEST_CASE("render refuses options of a path, video or folder where there is none", "[render]") {
  const TemporaryFolder folder;
  const std::string field = tiny_field(folder, tiny_scene(folder));
  const auto refusal = [&](std::vector<std::string> more) {
    std::vector<std::string> words{"render", "--field", field};
    words.insert(words.end(), more.begin(), more.end());
    const Outcome r = run_command(words);
    CHECK(r.code == cli::kUsage);
    return r.err;
  };
  const std::string out = folder / "v", video = folder / "v.mp4";
  CHECK_THAT(refusal({"--out", out, "--fps", "30"}), Contains("--fps: needs a video as --out"));
  CHECK_THAT(refusal({"--out", video, "--alpha"}), Contains("--alpha, --depth: need a folder as --out"));
  CHECK_THAT(refusal({"--out", video, "--depth"}), Contains("is a video"));
  CHECK_THAT(refusal({"--out", video, "--overwrite"}), Contains("--overwrite: for folders"));
  CHECK_THAT(refusal({"--out", video, "--against", field, "--sheet", video}),
             Contains("must differ from --out"));
  CHECK_THAT(refusal({"--out", out, "--path", "orbit", "--cameras", "ring"}), Contains("excludes"));
  CHECK_THAT(refusal({"--out", out, "--path", folder / "p.json", "--count", "3"}),
             Contains("has cameras of its own"));
  CHECK(!std::filesystem::exists(out));
  const Outcome missing =
      run_command({"render", "--field", field, "--out", out, "--path", folder / "none.json"});
  CHECK(missing.code == cli::kFailed);
  CHECK_THAT(missing.err, Contains("none.json"));
  CHECK(!std::filesystem::exists(out));
}
