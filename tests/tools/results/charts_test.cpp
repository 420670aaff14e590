#include <fieldmark/core/error.h>
#include <fieldmark/core/files.h>
#include <fieldmark/tools/results/charts.h>

#include "support/catch.h"
#include "support/temporary_folder.h"

using namespace fieldmark;
using namespace fieldmark::results;

TEST_CASE("result_chart: kernels as parts of the peak, a peer beside them") {
  const Json result{
      {"peak_gflops", 100},
      {"isa", "v3"},
      {"rows",
       {{{"name", "mlp"}, {"gflops", 80}, {"ratio_to_peak", 0.8}, {"peer_ratio", 2}},
        {{"name", "hash"}, {"gflops", nullptr}, {"items_per_second", 1e8}, {"ratio_to_scalar", 3}},
        {{"name", "step"}, {"gflops", nullptr}, {"items_per_second", 2e6}}}}};
  CHECK_THAT(result_chart("engine", result),
             Contains("0.80 of peak, 80.0 GFLOP/s") && Contains("2.00 x our time") &&
                 Contains("10.0 ns a point, 3.00 x scalar") && Contains("2.000 million samples/s"));
}

TEST_CASE("result_chart: attacks as curves against damage") {
  const Json result{
      {"images",
       {{{"attack", "noise_0.1"}, {"psnr_foreground", 20}, {"blind", 0.9}, {"chosen", nullptr}},
        {{"attack", "noise_0.2"}, {"psnr_foreground", 15}, {"blind", 0.8}, {"chosen", nullptr}},
        {{"attack", "crop_0.4"}, {"psnr_foreground", nullptr}, {"blind", 0.8}, {"chosen", nullptr}}}},
      {"fields", {{{"attack", "int8-blocks"}, {"psnr_foreground", 40}, {"blind", 0.5}, {"chosen", 1}}}}};
  CHECK_THAT(result_chart("attacks", result),
             Contains(">noise<") && Contains("blind, %") && !Contains("crop"));
  CHECK_THAT(result_chart("attacks-fields", result),
             Contains(">int-blocks<") && Contains("chosen detection"));
  CHECK(result_chart("attacks", {{"images", Json::array()}}).empty());
}

TEST_CASE("result_chart: fields and embeddings, the default with a ring") {
  const Json field{{"field", "lego"},
                   {"rows",
                    {{{"knob", "default"}, {"setting", ""}, {"seconds", 0.5}, {"psnr", 40}},
                     {{"knob", "step"}, {"setting", "long"}, {"seconds", 0.25}, {"psnr", 35}}}}};
  CHECK_THAT(result_chart("field", field), Contains(">long<") && Contains("r=\"9\""));
  const auto row = [](const char* choice, bool front) {
    return Json{{"choice", choice}, {"setting", "so"},  {"front", front},
                {"seconds", 60},    {"accuracy", 0.99}, {"psnr_foreground", 36}};
  };
  const Json embed{{"field", "chair"},
                   {"rows", {row("default", false), row("cells", true), row("patch", false)}},
                   {"curves", {row("default", false), row("patch", false)}}};
  CHECK_THAT(result_chart("embed", embed), Contains("cells: so, 36.0 dB") && Contains(">others<"));
  CHECK_THAT(result_chart("embed-curves", embed), Contains(">default<") && !Contains("patch"));
}

TEST_CASE("write_charts writes the companion beside the chart, and an unknown chart is refused") {
  const TemporaryFolder folder;
  CHECK(chart_files("attacks", folder / "a.svg") == Words{folder / "a.svg", folder / "a-fields.svg"});
  CHECK(chart_files("field", "a.svg") == Words{"a.svg"});
  write_charts(
      "field", folder / "f.svg",
      {{"field", "x"}, {"rows", {{{"knob", "default"}, {"setting", ""}, {"seconds", 1}, {"psnr", 40}}}}});
  CHECK_THAT(read_text(folder / "f.svg"), Contains("<svg"));
  CHECK_THROWS_WITH(result_chart("pie", {}), Contains("got 'pie'"));
}
