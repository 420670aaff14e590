#include <fieldmark/baselines/paper_plan.h>
#include <fieldmark/baselines/published.h>

#include <numeric>
#include <string>
#include <vector>

#include "support/catch.h"

using namespace fieldmark::baselines;

namespace {
double row_sum(const char* table, const char* system, const std::vector<std::string>& columns) {
  return std::accumulate(columns.begin(), columns.end(), 0.0, [&](double sum, const std::string& column) {
    return sum + published(table, system, column).value();
  });
}
}  // namespace

// Compares sums of the printed rows, which reveal a wrong digit.
TEST_CASE("published: rows of the paper") {
  const std::vector<std::string> lengths{"4", "8", "16", "32", "48"};
  CHECK(row_sum("bits", "copyrnerf_paper", lengths) == Approx(429.30));
  CHECK(row_sum("bits", "hidden_nerf", lengths) == Approx(250.90));
  CHECK(row_sum("bits", "mbrs_nerf", lengths) == Approx(255.10));
  CHECK(row_sum("bits", "nerf_message", lengths) == Approx(288.95));
  CHECK(row_sum("bits", "geometry", lengths) == Approx(313.13));
  const std::vector<std::string> distortions{"none", "noise_0.1", "rotation_30", "scale_0.75", "blur_0.1"};
  CHECK(row_sum("distortion", "copyrnerf_paper", distortions) == Approx(449.12));
  CHECK(row_sum("distortion", "without_drr", distortions) == Approx(430.68));
  CHECK(row_sum("distortion", "nerf_message", distortions) == Approx(254.50));
  CHECK(row_sum("distortion", "geometry", distortions) == Approx(294.57));
  const std::vector<std::string> sampling{"32_asp_32_isp", "64_asp", "32_asp", "16_asp", "64_rsp"};
  CHECK(row_sum("sampling", "copyrnerf_paper", sampling) == Approx(441.56));
  CHECK(published("weights", "copyrnerf_paper", "weights_0.01") == 93.97);
  CHECK(published("quality", "mbrs_nerf", "psnr") == 28.79);
  CHECK(published("ablation", "without_cff", "ssim") == 0.612);
}

TEST_CASE("published: tables that repeat a figure agree, and what is not there is nothing") {
  for (const char* system : {"copyrnerf_paper", "hidden_nerf", "mbrs_nerf", "nerf_message", "geometry"}) {
    CAPTURE(system);
    CHECK(published("bits", system, "16") == published("quality", system, "accuracy"));
    CHECK(published("bits", system, "16") == published("distortion", system, "none"));
  }
  CHECK(!published("bits", "ours", "16"));
  CHECK(!published("bits", "copyrnerf_paper", "17"));
  CHECK(!published("", "", ""));
}
