#include <fieldmark/core/files.h>

#include "cli/cli.h"
#include "tools/tiny_job.h"

using namespace fieldmark;

TEST_CASE("extract reads every image and all together", "[extract]") {
  const TinyJob& job = TinyJob::get();
  const auto r =
      run_command({"extract", "--owner", job.owner, "--detection", "blind", job.images(), "--json", "-"});
  INFO(r.err);
  REQUIRE(r.code == cli::kOk);
  const auto json = nlohmann::json::parse(r.out);
  CHECK(json["message"].get<std::string>().size() == 1);
  CHECK(json["bits"].get<std::string>().size() == 4);
  CHECK(json["detection"] == "blind");
  REQUIRE(json["p_noise"].size() == json["logits"].size());
  for (const auto& p : json["p_noise"]) CHECK((p > 0 && p <= 1));
  REQUIRE(json["views"].size() == 2);
  CHECK(json["views"][0]["bits"].get<std::string>().size() == 4);
  CHECK(json["views"][0]["logits"].size() == 4);
  CHECK(json["views"][0]["detection"] == "blind");
  CHECK(json["views"][0]["agreement"].is_null());
}

TEST_CASE("extract says which reading it chose and how well the image agrees", "[extract]") {
  const TinyJob& job = TinyJob::get();
  const std::string images = job.images();
  for (const std::string how : {"auto", "informed"}) {
    const auto r = run_command({"extract", "--owner", job.owner, "--detection", how, images, "--json", "-"});
    INFO(r.err);
    REQUIRE(r.code == cli::kOk);
    const auto json = nlohmann::json::parse(r.out);
    for (const auto& view : json["views"]) {
      CHECK((view["detection"] == "blind" || view["detection"] == "informed"));
      CHECK(view["agreement"].is_number());
      CHECK_THAT(r.err,
                 Contains(view["image"].get<std::string>() + "  " + view["detection"].get<std::string>()));
    }
  }
  CHECK(run_command({"extract", "--owner", job.owner, "--detection", "both", images}).code == cli::kUsage);
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
