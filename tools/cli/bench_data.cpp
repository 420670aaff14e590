#include <fieldmark/tools/bench/data_bench.h>

#include "cli/bench.h"
#include "cli/shared_data.h"

namespace fieldmark::cli {
namespace {

constexpr Index kLensViews = 50;  // of the built-in scene

struct BenchDataArguments {
  std::string object, place;
  double seconds = 60;
  Index size = 200;
};

std::string or_shared(const std::string& folder, const char* name) {
  return folder.empty() ? shared_data(name).string() : folder;
}

// Returns the groups; skips the place if it has no data set.
std::vector<bench::DataGroup> groups_of(const BenchDataArguments& o, Context& context) {
  const auto load = [&](const std::string& folder, const char* split) {
    return nerf::load_dataset(folder, {.split = split, .size = o.size, .resampled = true});
  };
  std::vector<bench::DataGroup> groups;
  const std::string object = or_shared(o.object, "nerf_synthetic/lego"), place = or_shared(o.place, "fox");
  if (object.empty()) {
    const nerf::SceneOptions built_in{.size = o.size, .seed = context.seed()};
    groups.push_back(
        bench::object_forms(nerf::make_scene(built_in, "train"), nerf::make_scene(built_in, "test")));
  } else {
    groups.push_back(bench::object_forms(load(object, "train"), load(object, "test")));
  }
  if (place.empty())
    context.note("no --place and no FIELDMARK_DATA: forms of a place are not measured");
  else
    groups.push_back(bench::place_forms(load(place, "train"), load(place, "test")));
  groups.push_back(bench::lens_forms({.size = o.size, .views = kLensViews, .seed = context.seed()}));
  return groups;
}

int run_bench_data(const BenchDataArguments& o, Context& context) {
  Json list = Json::array();
  Index met = 0, compared = 0;
  for (const bench::DataGroup& group : groups_of(o, context)) {
    const auto rows = with_progress(context, [&](const auto& progress) {
      return bench::run_data_bench(group, o.seconds, context.seed(), progress);
    });
    for (const bench::DataRow& r : rows) {
      const bool reference = r.form == rows.front().form, within = r.loss <= r.most_loss;
      compared += !reference, met += !reference && within;
      print_line(context, "%-8s %-46s %-8s %6ld steps  %6.2f dB", r.scene.c_str(), r.form.c_str(),
                 nerf::name_of(r.type).c_str(), static_cast<long>(r.steps), r.psnr);
      if (!reference) print_line(context, "  loses %5.2f dB of at most %.1f", r.loss, r.most_loss);
      print_line(context, "%s\n", !reference && !within ? "  MISSED" : "");
      list.push_back({{"scene", r.scene},
                      {"form", r.form},
                      {"scene_type", nerf::name_of(r.type)},
                      {"steps", r.steps},
                      {"psnr", number(r.psnr)},
                      {"loss", reference ? Json() : number(r.loss)},
                      {"most_loss", reference ? Json() : Json(r.most_loss)}});
    }
  }
  context.result(
      {{"seconds", o.seconds}, {"size", o.size}, {"compared", compared}, {"met", met}, {"rows", list}});
  return kOk;
}

}  // namespace

Command add_bench_data(CommandLine& app) {
  auto o = std::make_shared<BenchDataArguments>();
  app.add_option("--object", o->object, "Data set of an object with silhouettes")
      ->type_name("DIR")
      ->default_str("lego of FIELDMARK_DATA, else the built-in scene");
  app.add_option("--place", o->place, "Data set of a place with a background")
      ->type_name("DIR")
      ->default_str("fox of FIELDMARK_DATA, else none");
  add_number(app, "--size", o->size, 16, 8192, "Longer side of the images in pixels, 16 to 8192");
  add_number(app, "--seconds", o->seconds, 0.1, 86400,
             "Training time of the plain form in seconds, 0.1 to 86400; the others take as many steps", "S");
  return [o](Context& context) { return run_bench_data(*o, context); };
}

}  // namespace fieldmark::cli
