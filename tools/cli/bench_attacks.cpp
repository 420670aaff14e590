#include <fieldmark/tools/results/charts.h>
#include <fieldmark/watermark/attacks/attack_curves.h>
#include <fieldmark/watermark/attacks/attack_meter.h>
#include <fieldmark/watermark/attacks/field_attack.h>

#include <filesystem>
#include <memory>
#include <optional>

#include "cli/bench.h"
#include "cli/code_option.h"
#include "cli/measured.h"
#include "cli/message_option.h"

namespace fieldmark::cli {
namespace {

using watermark::AttackRow;
using Names = std::vector<std::string>;

struct BenchAttacksArguments {
  std::string owner, key, field, other, onto, cameras = "novel", plot;
  MessageOption message;  // baked into the field
  Names attacked;         // files derived from the field by other means
  Index count = 50, size = 0;
  std::optional<Index> informed_count;
  bool quick = false;
};

class Bench {
 public:
  Bench(const BenchAttacksArguments& options, Context& context)
      : options_(options),
        context_(context),
        owner_(keyed_owner(options.owner, options.key, context)),
        message_(message_of(options.message, owner_.options().bits)),
        marked_(nerf::RadianceField::load(options.field)),
        progress_(new Progress(context.progress("none"))),  // the meter begins with the views themselves
        meter_(owner_, marked_, message_, meter_options()) {}

  const watermark::AttackMeter& meter() const { return meter_; }
  const nerf::RadianceField& marked() const { return marked_; }
  const watermark::Owner& owner() const { return owner_; }

  Json image(const std::string& name) {
    return add(name, [&] { return meter_.image(name); });
  }
  // Adds the row of an attack on the marked field; with `onto`, damage is measured against that field.
  Json field(const std::string& name, const watermark::FieldAttackInputs& inputs,
             const nerf::RadianceField* onto = nullptr) {
    return add(name, [&] {
      const auto attacked = watermark::apply_field_attack(
          watermark::parse_field_attack(name), onto ? *onto : marked_, CounterRng(context_.seed()), inputs);
      return meter_.field(name, attacked, onto);
    });
  }
  Json file(const std::string& path) {
    const std::string name = std::filesystem::path(path).stem().string();
    return add(name, [&] { return meter_.field(name, nerf::RadianceField::load(path)); });
  }
  Json none() {
    return add("none", [&] { return meter_.none(); });
  }

 private:
  watermark::AttackMeterOptions meter_options() {
    return {.cameras = nerf::make_cameras(owner_.field.cameras, nerf::parse_camera_set(options_.cameras),
                                          options_.count, options_.size, context_.seed()),
            .informed_views = informed_views(options_.informed_count, 4, owner_),
            .seed = context_.seed(),
            .progress = [this](Index done, Index total) {
              if (guard_.interrupted()) throw Interrupted("nothing was written");
              progress_->update(static_cast<double>(done) / static_cast<double>(total));
              return true;
            }};
  }
  template <class F>
  Json add(const std::string& name, const F& measure) {
    progress_.reset(new Progress(context_.progress(name)));  // not movable
    const AttackRow row = measure();
    progress_.reset();  // ends the line of a terminal
    char informed[60] = "";
    if (meter_.informed_views() > 0)
      std::snprintf(informed, sizeof informed, "  informed %6.2f%%  chosen %6.2f%%",
                    100 * row.accuracy.informed, 100 * row.accuracy.chosen);
    print_line(context_, "%-24s %6.2f%%%s  worst 5%% %6.2f%%  p %.1e  %6.2f dB  kept %3.0f%%\n", name.c_str(),
               100 * row.accuracy.blind, informed, 100 * row.accuracy_p5, row.p_value, row.psnr_foreground,
               100 * row.kept);
    return {{"attack", row.name},
            {"blind", number(row.accuracy.blind)},
            {"informed", number(row.accuracy.informed)},
            {"chosen", number(row.accuracy.chosen)},
            {"found", number(row.accuracy.found)},
            {"blind_p5", number(row.accuracy_p5)},
            {"p_value", row.p_value},
            {"psnr_foreground", number(row.psnr_foreground)},
            {"kept", number(row.kept)}};
  }

  const BenchAttacksArguments& options_;
  Context& context_;
  const InterruptGuard guard_;
  watermark::Owner owner_;
  watermark::Message message_;
  nerf::RadianceField marked_;
  std::unique_ptr<Progress> progress_;  // of the row that is measured
  watermark::AttackMeter meter_;
};

constexpr const char* kDamage =
    "psnr_foreground: attacked against marked image on the foreground, dB, after moved pixels are moved "
    "back; kept: "
    "share of the foreground's pixels still shown; blind, blind_p5: from the image alone, all views; "
    "informed: the first informed_views views; chosen: the detection that extract chooses there, by "
    "agreement "
    "alone; p_value: of 10 views together, by the detection chosen or blind beyond informed_views, median; "
    "found: share of these views whose own p-value is at most 1e-6";

void check(const BenchAttacksArguments& o) {
  for (const std::string& path : o.attacked)
    if (!std::filesystem::exists(path)) throw IoError(path + ": no such file");
  if (o.plot.empty()) return;
  for (const std::string& file : results::chart_files("attacks", o.plot)) check_writable_page(file);
}

// Returns the severities of a curve, or only its middle one.
Names used(const Names& names, bool quick) { return quick ? Names{names[names.size() / 2]} : names; }

int run_bench_attacks(const BenchAttacksArguments& options, Context& context) {
  check(options);
  std::optional<nerf::RadianceField> other, onto;
  if (!options.other.empty()) other.emplace(nerf::RadianceField::load(options.other));
  if (!options.onto.empty()) onto.emplace(nerf::RadianceField::load(options.onto));
  Bench bench(options, context);
  Json unattacked = bench.none(), images = Json::array(), fields = Json::array();
  unattacked.erase("attack");
  for (const Names& names : watermark::image_attack_curves())
    for (const auto& name : used(names, options.quick)) images.push_back(bench.image(name));
  for (const Names& names : watermark::field_attack_curves())
    for (const auto& name : used(names, options.quick))
      fields.push_back(bench.field(name, {.unmarked = &bench.owner().field}));
  if (other)
    for (const auto& name : used(watermark::average_attack_curve(), options.quick))
      fields.push_back(bench.field(name, {.other = &*other}));
  if (onto)
    for (const auto& name : used(watermark::copy_attack_curve(), options.quick))
      fields.push_back(
          bench.field(name, {.unmarked = &bench.owner().field, .marked = &bench.marked()}, &*onto));
  for (const std::string& path : options.attacked) fields.push_back(bench.file(path));
  const Json json{{"field", std::filesystem::path(options.field).filename().string()},
                  {"bits", bench.owner().options().bits},
                  {"views", options.count},
                  {"informed_views", bench.meter().informed_views()},
                  {"cameras", options.cameras},
                  {"columns", kDamage},
                  {"unattacked", unattacked},
                  {"images", images},
                  {"fields", fields}};
  if (!options.plot.empty()) results::write_charts("attacks", options.plot, json);
  context.result(json);
  return kOk;
}

}  // namespace

Command add_bench_attacks(CommandLine& app) {
  auto o = std::make_shared<BenchAttacksArguments>();
  add_file(app, "--field", o->field, "Baked field to attack", "FIELD")->required();
  add_file(app, "--owner", o->owner, "Owner file from `fieldmark embed`", "OWNER")->required();
  add_key_option(app, o->key);
  add_message_options(app, o->message, "Message baked into --field");
  add_file(app, "--other", o->other,
           "Field baked for another copy or message, to average with; default: no such row", "FIELD");
  add_file(app, "--onto", o->onto, "Field of another scene, to copy the mark onto; default: no such row",
           "FIELD");
  app.add_option("--attacked", o->attacked, "Attacked field made by other means, one row each; repeatable")
      ->type_name("FIELD")
      ->default_str("");
  app.add_option("--cameras", o->cameras,
                 "Cameras of the views: novel, ring or sphere, see `fieldmark measure --help`")
      ->one_of({"novel", "ring", "sphere"})
      ->type_name("SET");
  add_number(app, "--count", o->count, 1, 1000, "Views to read in each row, 1 to 1000");
  app.add_option("--informed-count", o->informed_count,
                 "Views to read by informed detection as well, 0 to 1000; takes seconds per view and row; "
                 "default: 4, or 0 for "
                 "marks without cells")
      ->range(0, 1000)
      ->type_name("N")
      ->default_str("");
  add_number(app, "--size", o->size, 16, 8192,
             "Longer side of the views in pixels, 16 to 8192; default: as trained")
      ->default_str("");
  add_plot(app, o->plot);
  app.add_flag("--quick", o->quick, "Measure one severity of each attack");
  return [o](Context& context) {
    if (!o->message.given()) throw UsageError("the --message baked into --field is needed");
    return run_bench_attacks(*o, context);
  };
}

}  // namespace fieldmark::cli
