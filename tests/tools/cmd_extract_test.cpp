#include <fieldmark/core/files.h>

#include <fieldmark/imaging/image.h>
#include "cli/cli.h"
#include "imaging/video/video_samples.h"
#include "tools/tiny_job.h"

using namespace fieldmark;

TEST_CASE("extract reads every image and all together", "[extract]") {
  const TinyJob& job = TinyJob::get();
  const auto r =
      run_command({"extract", "--owner", job.owner, "--detection", "blind", job.images(), "--json", "-"});
  INFO(r.err);
  REQUIRE(r.code == cli::kNotFound);  // unmarked images
  CHECK_THAT(r.err, Contains("NOTHING READ at a false-positive rate of 1e-06"));
  const auto json = nlohmann::json::parse(r.out);
  CHECK(json["read"] == false);
  CHECK(json["message"].get<std::string>().size() == 1);
  CHECK(json["bits"].get<std::string>().size() == 4);
  CHECK(json["detection"] == "blind");
  CHECK(json["p_noise"] > 1e-6);
  CHECK(json["p_noise"] <= 1);
  REQUIRE(json["bit_p_values"].size() == json["logits"].size());
  for (const auto& p : json["bit_p_values"]) CHECK((p > 0 && p <= 1));
  CHECK(json["views"][0]["p_noise"].is_number());
  REQUIRE(json["views"].size() == 2);
  CHECK(json["views"][0]["bits"].get<std::string>().size() == 4);
  CHECK(json["views"][0]["logits"].size() == 4);
  CHECK(json["views"][0]["detection"] == "blind");
  CHECK(json["views"][0]["agreement"].is_null());
  REQUIRE(json["seconds_per_image"].is_number());  // infinity and NaN are null
  CHECK(json["seconds_per_image"] > 0);
}

TEST_CASE("extract says which reading it chose and how well the image agrees", "[extract]") {
  const TinyJob& job = TinyJob::get();
  const std::string images = job.images();
  for (const std::string how : {"auto", "informed"}) {
    const auto r = run_command(
        {"extract", "--owner", job.owner, "--detection", how, images, "--fpr", "1", "--json", "-"});
    INFO(r.err);
    REQUIRE(r.code == cli::kOk);
    CHECK_THAT(r.err, Contains("READ at a false-positive rate of 1") && Contains("of 4 bits are weak"));
    const auto json = nlohmann::json::parse(r.out);
    REQUIRE(json["views"].size() == 2);
    for (const auto& view : json["views"]) {
      if (how == "informed")
        CHECK(view["detection"] == "informed");
      else
        CHECK((view["detection"] == "blind" || view["detection"] == "informed"));
      CHECK(view["agreement"].is_number());
      CHECK_THAT(r.err,
                 Contains(view["image"].get<std::string>() + "  " + view["detection"].get<std::string>()));
    }
  }
  CHECK(run_command({"extract", "--owner", job.owner, "--detection", "both", images}).code == cli::kUsage);
}

TEST_CASE("extract reads the other images of a folder that has a broken one", "[extract]") {
  const TinyJob& job = TinyJob::get();
  const TemporaryFolder folder;
  std::filesystem::copy(job.images(), folder / "views");
  const std::string broken = folder / "views/view_000b.png", foreign = folder / "views/caf\xe9.png";
  write_file_atomically(broken, std::string_view("no image"));
  write_file_atomically(folder / "views/._view_000.png", std::string_view("of a Mac"));
  std::filesystem::rename(folder / "views/view_001.png", foreign);
  const auto r = run_command({"extract", "--owner", job.owner, "--detection", "blind", folder / "views",
                              "--fpr", "1", "--json", "-"});
  CHECK(r.code == cli::kFailed);
  CHECK_THAT(r.err, Contains("left out") && Contains("view_000b.png") && Contains("1 hidden"));
  const auto json = nlohmann::json::parse(r.out);
  CHECK(json["views"].size() == 2);
  REQUIRE(json["left_out"].size() == 1);
  CHECK(json["left_out"][0]["image"] == broken);
}

TEST_CASE("extract names the image that cannot be read", "[extract]") {
  const TinyJob& job = TinyJob::get();
  const std::string broken = job.folder / "broken.png";
  write_file_atomically(broken, std::string_view("no image"));
  const auto r = run_command({"extract", "--owner", job.owner, broken});
  CHECK(r.code == cli::kFailed);
  CHECK_THAT(r.err, Contains("broken.png"));
  CHECK(run_command({"extract", "--owner", job.owner, "/no/such.png"}).code == cli::kFailed);
  CHECK(run_command({"extract", "--owner", job.owner}).code == cli::kUsage);
}

TEST_CASE("extract refuses a rate that no image can reach, and takes another key", "[extract]") {
  const TinyJob& job = TinyJob::get();
  const auto rate = run_command({"extract", "--owner", job.owner, "--fpr", "1e-100", job.images()});
  CHECK(rate.code == cli::kUsage);
  CHECK_THAT(rate.err, Contains("--fpr") && Contains("no image can reach 1e-100"));
  const std::string key = test_key_file(job.folder, 6);
  const auto read = [&](std::vector<std::string> more) {
    std::vector<std::string> words{"extract", "--owner",    job.owner, "--detection",
                                   "blind",   job.images(), "--json",  "-"};
    words.insert(words.end(), more.begin(), more.end());
    return nlohmann::json::parse(run_command(words).out)["logits"];
  };
  CHECK(read({}) != read({"--key", key}));
}

TEST_CASE("extract reads frames of a video, evenly over its time", "[extract]") {
  if (!video_or_skip()) return;
  const TinyJob& job = TinyJob::get();
  const TemporaryFolder folder;
  const std::string images = job.images(), clip = folder / "clip.bin";  // the content decides, not the name
  VideoWriter writer(32, 32, {.crf = 5, .frames_per_second = 10});
  for (int k = 0; k < 10; ++k) writer.add(read_image(images + (k < 5 ? "/view_000.png" : "/view_001.png")));
  write_file_atomically(clip, std::span<const std::byte>(writer.finish()));
  const auto extract = [&](std::vector<std::string> more) {
    std::vector<std::string> words{"extract", "--owner", job.owner, "--detection", "blind", "--fpr",
                                   "1",       "--json",  "-"};
    words.insert(words.end(), more.begin(), more.end());
    return run_command(words);
  };
  const auto unkept = extract({clip, "--readings", folder / "readings"});
  CHECK(unkept.code == cli::kUsage);
  CHECK_THAT(unkept.err, Contains("--readings: keeps readings of images, and there are only videos"));
  const auto r = extract({clip, images + "/view_000.png", "--frames", "2"});
  INFO(r.err);
  REQUIRE(r.code == cli::kOk);
  const auto views = nlohmann::json::parse(r.out)["views"];
  REQUIRE(views.size() == 3);
  CHECK(views[0]["image"] == clip + "@0.200s");
  CHECK(views[1]["image"] == clip + "@0.700s");
  CHECK(views[1]["time"].get<double>() == Approx(0.7).margin(0.001));
  CHECK(views[2]["time"].is_null());
  CHECK(nlohmann::json::parse(extract({clip}).out)["views"].size() == 10);  // each of the ten frames once
  const auto none = extract({images, "--frames", "2"});
  CHECK(none.code == cli::kUsage);
  CHECK_THAT(none.err, Contains("--frames: there is no video among the images"));
  write_file_atomically(folder / "sound.mp4", std::span<const std::byte>(from_base64(kAudio)));
  const auto sound = extract({folder / "sound.mp4", images});
  CHECK(sound.code == cli::kFailed);
  CHECK(nlohmann::json::parse(sound.out)["left_out"].size() == 1);
  CHECK_THAT(sound.err, Contains("sound.mp4: expected a video, found a file without: only audio"));
}
