#include <fieldmark/tools/bench/captures_bench.h>

#include "cli/bench.h"

namespace fieldmark::cli {
namespace {

constexpr Index kQuickFit = 5;  // steps

struct BenchCapturesArguments {
  std::string scene;
  double seconds = 60, degrees = 0.5, move = 0.01;
  bool quick = false;
};

int run_bench_captures(const BenchCapturesArguments& o, Context& context) {
  const nerf::Dataset train = bench_split(o.scene, "train", o.quick),
                      test = bench_split(o.scene, "test", o.quick);
  const bench::PoseJitter jitter{.degrees = o.degrees, .part = o.move, .seed = context.seed()};
  bench::CaptureRun run{.seconds = o.seconds, .seed = context.seed()};
  if (o.quick) run.fit_steps = kQuickFit;
  const auto rows = with_progress(context, [&](const auto& progress) {
    return bench::run_captures_bench(train, test, run, jitter, progress);
  });
  Json list = Json::array();
  for (const bench::CaptureRow& r : rows) {
    print_line(context, "%-32s %6ld steps  %6.2f dB  colours fitted %6.2f dB  poses fitted %6.2f dB\n",
               r.variant.name.c_str(), static_cast<long>(r.steps), r.psnr, r.psnr_colour_fitted,
               r.psnr_pose_fitted);
    list.push_back({{"variant", r.variant.name},
                    {"steps", r.steps},
                    {"psnr", r.psnr},
                    {"psnr_colour_fitted", r.psnr_colour_fitted},
                    {"psnr_pose_fitted", r.psnr_pose_fitted}});
  }
  const auto said = [&](const char* how, double bench::CaptureRow::*psnr) -> Json {
    const double lost = bench::lost(rows, psnr), back = bench::recovered(rows, psnr);
    if (lost > 0)
      print_line(context, "%s: jitter loses %.2f dB, refined poses bring back %.0f%% of them\n", how, lost,
                 100 * back);
    else
      print_line(context, "%s: jitter loses nothing\n", how);
    return {{"lost", number(lost)}, {"recovered", number(back)}};
  };
  const Json as_they_are = said("test images as they are", &bench::CaptureRow::psnr),
             fitted = said("poses of the test images fitted", &bench::CaptureRow::psnr_pose_fitted);
  context.result({{"scene", train.name},
                  {"seconds_each", o.seconds},
                  {"degrees", o.degrees},
                  {"move", o.move},
                  {"test_views", test.views.size()},
                  {"as_they_are", as_they_are},
                  {"pose_fitted", fitted},
                  {"rows", list}});
  return kOk;
}

}  // namespace

Command add_bench_captures(CommandLine& app) {
  auto o = std::make_shared<BenchCapturesArguments>();
  add_scene_option(app, o->scene);
  add_number(app, "--seconds", o->seconds, 0.1, 86400, "Training time of each row in seconds, 0.1 to 86400",
             "S");
  add_number(app, "--degrees", o->degrees, 0, 45, "Rotation of jittered cameras in degrees, 0 to 45", "A");
  add_number(app, "--move", o->move, 0, 1, "Move of jittered cameras in distances to the scene, 0 to 1", "F");
  app.add_flag("--quick", o->quick,
               "Fit test poses for 5 steps; measure on a small scene if no data set is found");
  return [o](Context& context) { return run_bench_captures(*o, context); };
}

}  // namespace fieldmark::cli
