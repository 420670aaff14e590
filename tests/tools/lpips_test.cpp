#include "cli/lpips.h"

#include <cmath>
#include <cstdlib>
#include <sstream>

#include "support/catch.h"
#include "support/random_weights.h"
#include "support/temporary_folder.h"
#include "tools/environment.h"

using namespace fieldmark;
using cli::Context;

TEST_CASE("Weights for LPIPS come from the option, else from below FIELDMARK_DATA, else there are none",
          "[lpips]") {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder / "weights");
  const std::string path = folder / "weights/lpips_squeeze_v0.1.safetensors";
  random_weights(lpips_tensors(LpipsNetwork::squeeze)).write(path);
  std::ostringstream out, err;
  Context context({}, {"fieldmark", "x"}, out, err);
  {
    const EnvironmentVariable data("FIELDMARK_DATA", nullptr);
    CHECK(cli::load_lpips(LpipsNetwork::squeeze, path, context));
    CHECK(out.str().empty());
    CHECK_FALSE(cli::load_lpips(LpipsNetwork::squeeze, "", context));
    CHECK_THAT(out.str(), Contains("no LPIPS (squeeze): no weights given"));
  }
  const EnvironmentVariable data("FIELDMARK_DATA", folder.path.c_str());
  CHECK(cli::load_lpips(LpipsNetwork::squeeze, "", context));
  CHECK_FALSE(cli::load_lpips(LpipsNetwork::squeeze, "none", context));
  CHECK_FALSE(cli::load_lpips(LpipsNetwork::alex, "", context));
  CHECK_THROWS_WITH(cli::load_lpips(LpipsNetwork::alex, path, context),
                    Contains(path) && Contains("\"features.0.weight\": expected F32 [64, 3, 11, 11]"));
}

TEST_CASE("LPIPS of images that are too small, or without a network, is no number", "[lpips]") {
  const std::optional<Lpips<float>> squeeze(
      std::in_place, random_weights(lpips_tensors(LpipsNetwork::squeeze)), LpipsNetwork::squeeze);
  const Tensor<float> small({16, 40, 3}, 0.5f), a({17, 40, 3}, 0.5f), b({17, 40, 3}, 0.25f);
  CHECK(std::isnan(cli::lpips_or_nan(squeeze, small, small)));
  CHECK(std::isnan(cli::lpips_or_nan(std::nullopt, a, b)));
  CHECK(cli::lpips_or_nan(squeeze, a, a) == 0);
  CHECK(cli::lpips_or_nan(squeeze, a, b) > 0);
}
