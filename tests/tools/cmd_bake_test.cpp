#include <fieldmark/engine/safetensors.h>
#include <fieldmark/watermark/embedding/baker.h>

#include <cmath>

#include "cli/cli.h"
#include "tools/tiny_job.h"

using namespace fieldmark;

TEST_CASE("bake refuses a recipient that no list can name", "[bake]") {
  const TinyJob& job = TinyJob::get();
  const std::string out = job.folder / "spaced.fm";
  for (const char* name : {"Anna ", " Anna", "An\tna"}) {
    const auto r =
        run_command({"bake", "--owner", job.owner, "--message", "5", "--copy", name, "--out", out});
    CHECK(r.code == cli::kUsage);
    CHECK_THAT(r.err, Contains("--copy: recipient: expected a name without spaces"));
    CHECK(!std::filesystem::exists(out));
  }
}

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

TEST_CASE("bake makes the mark fainter where it is asked to", "[bake]") {
  const TinyJob& job = TinyJob::get();
  // Training starts from the unmarked colours; the fainter the mark, the closer they are to the target.
  const auto distance = [&](const char* mark_psnr) {
    const auto r =
        run_command({"bake", "--owner", job.owner, "--message", "5", "--out", job.folder / "fainter.fm",
                     "--steps", "1", "--mark-psnr", mark_psnr, "--json", "-"});
    INFO(r.err);
    REQUIRE(r.code == cli::kOk);
    return nlohmann::json::parse(r.out)["psnr_colours"].get<double>();
  };
  const auto one_step =
      run_command({"bake", "--owner", job.owner, "--message", "a", "--out", job.folder / "brief.fm",
                   "--steps", "1", "--mark-psnr", "20", "--json", "-"});
  CHECK_THAT(one_step.err, Contains("dB on the foreground, 20.0 dB requested"));
  const auto json = nlohmann::json::parse(one_step.out);
  const double learnt = json["mark_psnr_learnt"], taken = 100 * std::pow(10.0, (20 - learnt) / 20);
  REQUIRE(taken < 79);  // 2 dB
  CHECK_THAT(json["notes"][0].get<std::string>(),
             Contains("the colours of the file learned only " + std::to_string(std::lround(taken)) +
                      "% of the mark"));
  CHECK(json["scale"] == watermark::Baker::kLargestScale);
  // Twice the difference gives four times its square. PSNR compares 8-bit images: two roundings add 1/12 of a
  // squared step each, which matters more the fainter the mark is.
  const double rounding = 2 / 12. / (255 * 255), square = std::pow(10.0, -learnt / 10) - rounding;
  CHECK(json["mark_psnr"].get<double>() == Approx(-10 * std::log10(4 * square + rounding)).margin(0.25));
  const double strong = distance("30"), faint = distance("50");
  CHECK(faint - strong == Approx(20).margin(1));
  const auto r = run_command({"bake", "--owner", job.owner, "--message", "5", "--out",
                              job.folder / "refused.fm", "--steps", "1", "--mark-psnr", "19"});
  CHECK(r.code == cli::kUsage);
}

TEST_CASE("bake gives the file the strength asked for", "[bake]") {
  const TinyJob& job = TinyJob::get();
  const std::string out = job.folder / "asked.fm";
  const auto json_of = [](const std::vector<std::string>& line) {
    const auto r = run_command(line);
    INFO(r.err);
    REQUIRE(r.code == cli::kOk);
    return nlohmann::json::parse(r.out);
  };
  for (const char* mark_psnr : {"30", "38"}) {
    const auto bake = json_of({"bake", "--owner", job.owner, "--message", "5", "--out", out, "--steps", "60",
                               "--mark-psnr", mark_psnr, "--json", "-"});
    CAPTURE(bake);
    CHECK(bake["mark_psnr"].get<double>() == Approx(std::stod(mark_psnr)).margin(0.03));
    CHECK(bake.count("notes") == 0);
    const auto measured = json_of({"measure", "--informed-count", "0", "--owner", job.owner, "--field", out,
                                   "--message", "5", "--count", "60", "--json", "-"});
    CHECK(measured["psnr_base_foreground"].get<double>() == Approx(std::stod(mark_psnr)).margin(0.4));
  }
}

TEST_CASE("bake refuses a message that does not fit, and an owner that is none", "[bake]") {
  const TinyJob& job = TinyJob::get();
  const std::string out = job.folder / "refused.fm";
  const std::string more_than_cells(1000, '5');
  for (const std::string& message : {std::string(), more_than_cells, std::string("g")})
    CHECK(run_command({"bake", "--owner", job.owner, "--message", message, "--out", out, "--steps", "1"})
              .code == cli::kUsage);
  const auto kind =
      run_command({"bake", "--owner", job.field, "--message", "5", "--out", out, "--steps", "1"});
  CHECK(kind.code == cli::kFailed);
  CHECK_THAT(kind.err, Contains("expected an OWNER file (kind 'owner'), found kind 'field'"));
  CHECK(!std::filesystem::exists(out));
}

TEST_CASE("bake encodes payloads, and the other commands know them and their commitment", "[bake]") {
  const TinyJob& job = TinyJob::get();
  const std::string owner = job.folder / "long.fm", baked = job.folder / "long_baked.fm",
                    images = job.images();
  const auto json_in = [](const Outcome& r) {
    INFO(r.err);
    REQUIRE((r.code == cli::kOk || r.code == cli::kNotFound));
    return nlohmann::json::parse(r.out);
  };
  const auto json_of = [&](std::vector<std::string> line) {
    line.insert(line.end(), {"--json", "-"});
    return json_in(run_command(line));
  };
  const auto embedded = json_in(tiny_embed(job.field, owner,
                                           {"--bits", "48", "--cells", "8", "--steps", "1",
                                            "--measured-views", "1", "--text", "hi", "--json", "-"}));
  const auto bake = json_of({"bake", "--owner", owner, "--text", "hi", "--out", baked, "--steps", "1"});
  CHECK(bake["payload"] == nlohmann::json{{"kind", "text"}, {"value", "hi"}});
  CHECK(bake["message"].get<std::string>().substr(0, 5) == "76869");  // version 7, then the text
  CHECK(bake["commitment"] == embedded["commitment"]);
  CHECK(bake["owner_sha256"] == embedded["sha256"]);
  const auto verified = json_of({"verify", "--detection", "blind", "--owner", owner, "--text", "hi", images});
  CHECK(verified["commitment"] == bake["commitment"]);
  CHECK(verified["owner_sha256"] == bake["owner_sha256"]);
  CHECK(verified["payload"] == bake["payload"]);
  CHECK(json_of({"verify", "--detection", "blind", "--owner", owner, "--message", bake["message"],
                 images})["commitment"] == bake["commitment"]);
  CHECK(json_of({"verify", "--detection", "blind", "--owner", owner, "--payload", "c0fe",
                 images})["commitment"] != bake["commitment"]);
  // The field learned nothing, so there is nothing to read.
  const auto extracted = json_of({"extract", "--fpr", "1", "--owner", owner, images});
  CHECK(extracted["payload"].is_null());
  CHECK(extracted["views"][0]["payload"].is_null());
  const auto of_baked = json_of({"measure", "--informed-count", "0", "--owner", owner, "--field", baked,
                                 "--text", "hi", "--count", "2"});
  CHECK(of_baked["payload"]["trials"] == 2);
  CHECK(of_baked["payload"]["exact"] == 0);
  const auto drawn = json_of({"measure", "--informed-count", "0", "--owner", owner, "--count", "4",
                              "--payloads", "--together", "2", "--distort", "blur_1"});
  CHECK(drawn["payload"]["trials"] == 2);
  CHECK(drawn["payload"]["together"] == 2);
  CHECK(drawn["payload"]["distorted"]["blur_1"]["trials"] == 2);
  CHECK(drawn["payload"]["single"]["trials"] == 4);
  CHECK(drawn["payload"]["single"]["distorted"]["blur_1"]["trials"] == 4);
  CHECK(!of_baked["payload"].contains("single"));
  CHECK(json_of({"measure", "--informed-count", "0", "--owner", owner, "--count", "1"})["payload"].is_null());
  const auto refused = [&](const std::vector<std::string>& options, const char* why) {
    std::vector<std::string> line{"bake",    "--owner", owner, "--out", job.folder / "refused.fm",
                                  "--steps", "1"};
    line.insert(line.end(), options.begin(), options.end());
    const auto r = run_command(line);
    CHECK(r.code == cli::kUsage);
    CHECK_THAT(r.err, Contains(why));
  };
  refused({"--text", "hello"}, "has 40 bits, a message of 48 bits can hold at most 32");
  refused({"--text", "\xff"}, "byte 1 must begin a character of UTF-8");
  refused({"--uuid", "1234"}, "must have 32 digits");
  refused({"--payload", "xyz"}, "must be a digit");
  refused({"--text", "hi", "--message", "123456789abc"}, "excludes");
  refused({}, "one of --message, --text, --uuid and --payload is needed");
  for (const std::vector<std::string>& extra : {std::vector<std::string>{"--together", "3"},
                                                {"--payloads", "--field", baked, "--text", "hi"},
                                                {"--text", "hi"}}) {
    std::vector<std::string> line{"measure", "--informed-count", "0", "--owner", owner, "--count", "2"};
    line.insert(line.end(), extra.begin(), extra.end());
    CHECK(run_command(line).code == cli::kUsage);
  }
}

TEST_CASE("bake takes messages that are too long for a payload", "[bake]") {
  const TinyJob& job = TinyJob::get();
  const std::string baked = job.folder / "longest.fm", message(66, 'a');
  const std::string owner = job.folder / "many_cells.fm";
  REQUIRE(tiny_embed(job.field, owner, {"--cells", "12", "--steps", "1", "--measured-views", "1"}).code ==
          cli::kOk);
  const auto r = run_command(
      {"bake", "--owner", owner, "--message", message, "--out", baked, "--steps", "1", "--json", "-"});
  INFO(r.err);
  REQUIRE(r.code == cli::kOk);
  CHECK(nlohmann::json::parse(r.out)["payload"].is_null());
  const auto measured = run_command({"measure", "--owner", owner, "--bits", "264", "--count", "1"});
  CHECK(measured.code == cli::kUsage);
  CHECK_THAT(measured.err, Contains("--bits: measure takes messages of at most 256 bits, got 264"));
  const auto read = run_command({"extract", "--owner", owner, "--bits", "264", "--detection", "blind",
                                 "--fpr", "1", "--json", "-", job.images()});
  INFO(read.err);
  CHECK(read.code == cli::kOk);
  CHECK_THAT(read.err, Contains("none: a payload needs a message of at most 256 bits"));
}
