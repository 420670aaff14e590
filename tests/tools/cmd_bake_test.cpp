#include <fieldmark/engine/safetensors.h>

#include "cli/cli.h"
#include "tools/tiny_job.h"

using namespace fieldmark;

TEST_CASE("bake changes colours only, and says nothing of the message in the file", "[bake]") {
  const TinyJob& job = TinyJob::get();
  const auto bake = [&](const char* message) {
    const std::string out = job.folder / (std::string("baked_") + message);
    const auto r = run_command(
        {"bake", "--owner", job.owner, "--message", message, "--out", out, "--steps", "3", "--json", "-"});
    INFO(r.err);
    REQUIRE(r.code == cli::kOk);
    CHECK(nlohmann::json::parse(r.out)["steps"] == 3);
    return SafetensorsFile::read(out);
  };
  const auto plain = SafetensorsFile::read(job.field), a = bake("5"), b = bake("a");
  CHECK(a.metadata == plain.metadata);
  CHECK(b.metadata == plain.metadata);
  REQUIRE(a.tensors.size() == plain.tensors.size());
  bool colours_differ = false;
  for (std::size_t i = 0; i < a.tensors.size(); ++i) {
    const auto &x = a.tensors[i], &y = b.tensors[i], &p = plain.tensors[i];
    CHECK(x.name == p.name);
    CHECK(x.shape == p.shape);
    if (x.name.find("density") != std::string::npos) {
      CHECK(x.data == p.data);
      CHECK(y.data == p.data);
    } else if (x.data != y.data) {
      colours_differ = true;
    }
  }
  CHECK(colours_differ);
}

TEST_CASE("bake refuses a message that does not fit, and an owner that is none", "[bake]") {
  const TinyJob& job = TinyJob::get();
  const std::string out = job.folder / "refused.fm";
  for (const char* message : {"", "55", "g"})
    CHECK(run_command({"bake", "--owner", job.owner, "--message", message, "--out", out, "--steps", "1"})
              .code == cli::kUsage);
  const auto kind =
      run_command({"bake", "--owner", job.field, "--message", "5", "--out", out, "--steps", "1"});
  CHECK(kind.code == cli::kFailed);
  CHECK_THAT(kind.err, Contains("expected an OWNER file (kind 'owner'), found kind 'field'"));
  CHECK(!std::filesystem::exists(out));
}
