#include <fieldmark/core/error.h>
#include <fieldmark/tools/bench/embed_bench.h>

#include <chrono>
#include <cmath>
#include <thread>

#include "support/catch.h"
#include "watermark/tiny_owner.h"

using namespace fieldmark;
using namespace fieldmark::bench;

namespace {
EmbedVariant tiny_variant(Index steps) {
  EmbedVariant v = embed_variants({.steps = steps}, 4, 3).front();
  v.recipe.cells = 6;
  v.recipe.owner.reader_size = 48;
  v.recipe.owner.mark_psnr = 30;
  v.recipe.cell().base_channels = 8;
  v.recipe.cell().network = {.bands = 4, .features = 8};
  v.recipe.embed.batch = 2;
  v.recipe.embed.schedule.lr = 4e-3;
  v.recipe.views.count = 8;
  return v;
}

EmbedRow row(const char* choice, double seconds, double accuracy, double psnr) {
  EmbedRow r;
  r.variant.choice = choice;
  r.variant.setting = "so";
  r.seconds = seconds;
  r.accuracy = accuracy;
  r.psnr_foreground = psnr;
  return r;
}
}  // namespace

TEST_CASE("embed_bench: a mark is embedded in every way, and judged on the way and at the end") {
  std::vector<EmbedVariant> two{tiny_variant(8), tiny_variant(4)};
  two[1].choice = "length";
  two[1].recipe.views.samples = 2;
  double done = -1;
  std::vector<std::string> names;
  const auto rows = run_embed_bench(tiny_field(), two, {.views = 3, .points = 2},
                                    [&](const std::string& name, double part) {
                                      if (names.empty() || names.back() != name) names.push_back(name);
                                      CHECK(part >= done);
                                      done = part;
                                    });
  REQUIRE(rows.size() == 2);
  CHECK(names == std::vector<std::string>{"default: as embed does", "length: as embed does"});
  for (const EmbedRow& r : rows) {
    CHECK(r.steps == r.variant.recipe.embed.schedule.steps);
    CHECK(r.cache_seconds > 0);
    CHECK(r.seconds > r.cache_seconds);
    CHECK(r.psnr_foreground == Approx(30).margin(1.5));
    for (const double accuracy : {r.accuracy, r.accuracy_p5, r.closer, r.farther, r.extrapolated})
      CHECK((accuracy >= 0 && accuracy <= 1));
    REQUIRE(r.curve.size() == 2);
    CHECK(r.curve[0].seconds < r.curve[1].seconds);
    CHECK(r.curve[0].seconds > r.cache_seconds);
    CHECK(r.curve[1].accuracy == r.accuracy);
    CHECK(std::isfinite(r.curve[0].psnr_foreground));
  }
}

TEST_CASE("embed_bench: the clock of embedding stands still while a mark is judged") {
  using Now = std::chrono::steady_clock;
  const auto begin = Now::now();
  int calls = 0;
  const auto rows =
      run_embed_bench(tiny_field(), {tiny_variant(2)}, {.views = 6, .points = 1}, [&](const auto&, double) {
        // 8 views, 2 steps, then 6 + 3 * 2 evaluated images.
        if (++calls > 10) std::this_thread::sleep_for(std::chrono::milliseconds(50));
      });
  CHECK(calls == 8 + 2 + 12);
  const double whole = std::chrono::duration<double>(Now::now() - begin).count();
  CHECK(rows[0].seconds < whole - 0.55);
}

TEST_CASE("embed_bench: the front is of time, accuracy and PSNR together") {
  std::vector<EmbedRow> rows{row("default", 60, 0.90, 36.5), row("a", 61, 0.95, 36.5),
                             row("b", 20, 0.80, 36.5),       row("c", 60, 0.85, 40),
                             row("d", 120, 0.905, 36.5),     row("e", 60, 0.905, 36.6)};
  mark_front(rows);
  std::vector<bool> front;
  for (const EmbedRow& r : rows) front.push_back(r.front);
  CHECK(front == std::vector<bool>{false, true, true, true, false, false});
  CHECK(
      judgement(rows) ==
      "The default reads 90.0% of the bits at 36.50 dB after 60 s. What beats it: a: so (+5.0 points, +0.00 "
      "dB, 1.02 of the time).");
  rows.erase(rows.begin() + 1);
  mark_front(rows);
  CHECK(rows[0].front);
  CHECK_THAT(judgement(rows), Contains("It is on the front"));
  mark_front(rows, {.time = 0.08, .accuracy = 0.001, .psnr = 0.01});
  CHECK_FALSE(rows[0].front);  // e beats it once such small gains count
  CHECK_THROWS_WITH(judgement({}), "[judgement] rows must not be empty");
}

TEST_CASE("embed_bench: it can be stopped, and bad options are named") {
  const auto stop = [](const std::string&, double) { throw ValueError("stop"); };
  CHECK_THROWS_WITH(run_embed_bench(tiny_field(), {tiny_variant(2)}, {}, stop), "stop");
  CHECK_THROWS_WITH(run_embed_bench(tiny_field(), {}, {.views = 0}),
                    "[embed_bench] views and points must be at least 1, got 0 and 4");
}
