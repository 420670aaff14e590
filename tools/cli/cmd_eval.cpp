#include <fieldmark/nerf/evaluation.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <ostream>

#include "cli/cli.h"
#include "cli/commands.h"
#include "cli/context.h"

namespace fieldmark::cli {
namespace {

struct Options {
  std::string field, data;
  std::string split = "test";
  Index size = 0;
};

// JSON knows no infinity: equal pictures, like views without an object, are null.
Json number(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

int run(const Options& options, Context& context) {
  const auto field = nerf::RadianceField::load(options.field);
  const auto data = nerf::load_dataset(
      options.data, {.split = options.split, .size = options.size, .background = field.background});
  const InterruptGuard guard;
  nerf::Evaluation evaluation;
  {
    Progress progress = context.progress("eval");
    evaluation = nerf::evaluate(field, data, [&](Index done, Index total) {
      if (guard.interrupted()) throw Interrupted("");
      progress.update(static_cast<double>(done) / static_cast<double>(total));
    });
  }
  Json views = Json::array();
  const auto add = [&](const std::string& name, const nerf::Quality& q) {
    char line[160];
    std::snprintf(line, sizeof line, "%-16s %6.2f dB  object %6.2f dB  ssim %.4f\n", name.c_str(), q.psnr,
                  q.psnr_object, q.ssim);
    context.text() << line;
  };
  for (const auto& view : evaluation.views) {
    add(view.name, view.quality);
    views.push_back({{"image", view.name},
                     {"psnr", number(view.quality.psnr)},
                     {"psnr_object", number(view.quality.psnr_object)},
                     {"ssim", view.quality.ssim}});
  }
  add("mean", evaluation.mean);
  context.result({{"psnr", number(evaluation.mean.psnr)},
                  {"psnr_object", number(evaluation.mean.psnr_object)},
                  {"ssim", evaluation.mean.ssim},
                  {"lpips_alex", nullptr},
                  {"views", evaluation.views.size()},
                  {"scene", data.name},
                  {"split", data.split},
                  {"per_view", views}});
  return kOk;
}

}  // namespace

Command add_eval(CLI::App& app) {
  auto o = std::make_shared<Options>();
  app.add_option("--field", o->field, "Trained or baked field")->required()->type_name("FIELD");
  app.add_option("--data", o->data, "Data set, Blender layout")->required()->type_name("DIR");
  app.add_option("--split", o->split, "Views to compare with: train, val, test")
      ->check(CLI::IsMember({"train", "val", "test"}).description(""))
      ->type_name("SPLIT");
  app.add_option("--size", o->size, "Pixels of the pictures' longer side, 16 to 8192 (as they are)")
      ->check(CLI::Range(16, 8192).description(""))
      ->type_name("N")
      ->default_str("");
  return [o](Context& context) { return run(*o, context); };
}

}  // namespace fieldmark::cli
