#include <fieldmark/imaging/image.h>
#include <fieldmark/imaging/lpips.h>
#include <fieldmark/imaging/metrics.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "cli/cli.h"
#include "support/catch.h"
#include "support/data.h"
#include "support/random_weights.h"
#include "support/temporary_folder.h"
#include "tools/environment.h"
#include "tools/run_command.h"

using namespace fieldmark;

namespace {

struct Pairs {
  TemporaryFolder folder;
  std::string a = folder / "a", b = folder / "b", weights = folder / "squeeze.safetensors";
  Pairs() {
    random_weights(lpips_tensors(LpipsNetwork::squeeze)).write(weights);
    for (const auto& side : {a, b}) std::filesystem::create_directory(side);
    for (unsigned i = 0; i < 2; ++i)
      for (unsigned side = 0; side < 2; ++side)
        write_png((side == 0 ? a : b) + "/r_" + std::to_string(i) + ".png",
                  uniform<float>({24, 20, 3}, 0, 1, 10 * i + side));
  }
};

}  // namespace

TEST_CASE("compare prints PSNR, SSIM and LPIPS of two images, and the means of two folders", "[compare]") {
  const EnvironmentVariable data("FIELDMARK_DATA", nullptr);
  const Pairs p;
  const auto r = run_command({"compare", p.a, p.b, "--squeeze-weights", p.weights, "--json", "-"});
  INFO(r.err);
  REQUIRE(r.code == cli::kOk);
  CHECK_THAT(r.err, Contains("no LPIPS (alex)") && Contains("mean"));
  const nlohmann::json json = nlohmann::json::parse(r.out);
  REQUIRE(json["pairs"].size() == 2);
  CHECK(json["lpips_alex"].is_null());
  for (const char* key : {"psnr", "ssim", "lpips_squeeze"})
    CHECK(json[key].get<double>() ==
          Approx((json["pairs"][0][key].get<double>() + json["pairs"][1][key].get<double>()) / 2));
  const auto one = run_command(
      {"compare", p.a + "/r_1.png", p.b + "/r_1.png", "--squeeze-weights", p.weights, "--json", "-"});
  REQUIRE(one.code == cli::kOk);
  const nlohmann::json single = nlohmann::json::parse(one.out);
  const auto a = read_image(p.a + "/r_1.png"), b = read_image(p.b + "/r_1.png");
  const Lpips<float> squeeze(SafetensorsFile::read(p.weights), LpipsNetwork::squeeze);
  CHECK(single["psnr"].get<double>() == psnr(a, b));
  CHECK(single["ssim"].get<double>() == ssim(a, b));
  CHECK(single["lpips_squeeze"].get<double>() == squeeze.distance(a, b).value);
  CHECK(single["lpips_squeeze"] == json["pairs"][1]["lpips_squeeze"]);
  // Equal images have no PSNR; the distance is 0.
  const auto same = run_command({"compare", p.a, p.a, "--squeeze-weights", p.weights, "--json", "-"});
  CHECK(nlohmann::json::parse(same.out)["psnr"].is_null());
  CHECK(nlohmann::json::parse(same.out)["lpips_squeeze"] == 0);
}

TEST_CASE("compare refuses what cannot be paired", "[compare]") {
  const EnvironmentVariable data("FIELDMARK_DATA", nullptr);
  const Pairs p;
  CHECK(run_command({"compare", p.a}).code == cli::kUsage);
  CHECK(run_command({"compare", p.a, p.b, p.a}).code == cli::kUsage);
  CHECK(run_command({"compare", "--reference"}).code == cli::kUsage);
  CHECK(run_command({"compare", p.a, p.folder / "none"}).code == cli::kFailed);
  const auto count = run_command({"compare", p.a, p.b + "/r_0.png"});
  CHECK(count.code == cli::kFailed);
  CHECK_THAT(count.err, Contains("expected 2 images") && Contains("found 1"));
  const std::string small = p.folder / "small.png";
  write_png(small, Tensor<float>({8, 8, 3}));
  const auto size = run_command({"compare", small, p.b + "/r_0.png"});
  CHECK(size.code == cli::kFailed);
  CHECK_THAT(size.err, Contains("expected the size of") && Contains("[8, 8, 3], found [24, 20, 3]"));
  // Images too small for SSIM and LPIPS give no number and no error.
  const auto none = run_command({"compare", small, small, "--squeeze-weights", p.weights, "--json", "-"});
  REQUIRE(none.code == cli::kOk);
  CHECK(nlohmann::json::parse(none.out)["ssim"].is_null());
  CHECK(nlohmann::json::parse(none.out)["lpips_squeeze"].is_null());
}

TEST_CASE(
    "compare --reference holds LPIPS against the values in a folder, and fails where one is off or missing",
    "[compare]") {
  const auto folder = data_or_skip("lpips_reference", "compare --reference");
  if (!folder || !data_or_skip("weights", "compare --reference")) return;
  const auto r = run_command({"compare", "--reference", "--json", "-"});
  INFO(r.err);
  REQUIRE(r.code == cli::kOk);
  const nlohmann::json json = nlohmann::json::parse(r.out);
  CHECK(json["pairs"].size() == 12);
  CHECK(json["worst_error"].get<double>() < 1e-6);
  CHECK(json["worst_layer_error"].get<double>() < 1e-6);
  // Measured 5.1e-7 dB: the reference computes PSNR from images rounded to float in [-1, 1]; in double, such
  // images reproduce its values to 4e-15. The PSNR of their bytes is exact.
  CHECK(json["worst_psnr_error"].get<double>() < 1e-6);
  // One value changed by twice the limit.
  const TemporaryFolder changed;
  nlohmann::json reference = nlohmann::json::parse(std::ifstream(*folder / "lpips_reference.json"));
  reference["pairs"].erase(reference["pairs"].begin() + 1, reference["pairs"].end());
  for (const char* side : {"a", "b"}) {
    const std::string name = reference["pairs"][0][side];
    std::filesystem::copy(*folder / name, changed / name);
  }
  auto& value = reference["pairs"][0]["squeeze"]["value_f64"];
  value = value.get<double>() + 2e-4;
  std::ofstream(changed / "lpips_reference.json") << reference;
  const auto off = run_command({"compare", "--reference", changed.path.string(), "--json", "-"});
  CHECK(off.code == cli::kFailed);
  CHECK(nlohmann::json::parse(off.out)["worst_error"].get<double>() == Approx(2e-4).epsilon(0.01));
  // With a layer missing, its error is NaN, which counts as the worst.
  value = value.get<double>() - 2e-4;
  auto& layers = reference["pairs"][0]["alex"]["per_layer_f32"];
  layers.erase(layers.begin());
  std::ofstream(changed / "lpips_reference.json") << reference;
  CHECK(run_command({"compare", "--reference", changed.path.string()}).code == cli::kFailed);
}
