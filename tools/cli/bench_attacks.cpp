#include "cli/bench_attacks.h"

#include <fieldmark/core/files.h>
#include <fieldmark/imaging/scatter_chart.h>
#include <fieldmark/watermark/attacks/attack_meter.h>
#include <fieldmark/watermark/attacks/field_attack.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <ostream>

#include "cli/cli.h"
#include "cli/context.h"

namespace fieldmark::cli {
namespace {

using watermark::AttackRow;
using Names = std::vector<std::string>;

// Each line a curve, from mild to strong.
const std::vector<Names> kImages{
    {"noise_0.02", "noise_0.05", "noise_0.10", "noise_0.20"},
    {"blur_0.5", "blur_1", "blur_2", "blur_4"},
    {"jpeg_90", "jpeg_70", "jpeg_50", "jpeg_30", "jpeg_10"},
    {"jpeg444_90", "jpeg444_50", "jpeg444_10"},
    {"scale_0.75", "scale_0.5", "scale_0.25"},
    {"scale-nearest_0.75", "scale-nearest_0.5", "scale-nearest_0.25"},
    {"scale-bilinear_0.75", "scale-bilinear_0.5", "scale-bilinear_0.25"},
    {"scale-bicubic_1.5", "scale-bicubic_0.75", "scale-bicubic_0.5", "scale-bicubic_0.25"},
    {"scale-lanczos_0.75", "scale-lanczos_0.5", "scale-lanczos_0.25"},
    {"rotation_10", "rotation_30", "rotation_90"},
    {"crop_0.80", "crop_0.60", "crop_0.40", "crop_0.20"},
    {"gamma_0.9", "gamma_0.7", "gamma_0.5"},
    {"gamma_1.2", "gamma_1.5", "gamma_2.2"},
    {"brightness_0.9", "brightness_0.75", "brightness_0.5"},
    {"brightness_1.1", "brightness_1.25", "brightness_1.5"},
    {"contrast_0.9", "contrast_0.75", "contrast_0.5"},
    {"contrast_1.1", "contrast_1.25", "contrast_1.5"},
    {"hue_10", "hue_30", "hue_90", "hue_180"},
    {"greyscale"},
    {"combined"},
    {"screenshot", "screenshot,screenshot"}};
const std::vector<Names> kFields{{"weights_noise_0.01", "weights_noise_0.02", "weights_noise_0.05",
                                  "weights_noise_0.1", "weights_noise_0.2", "weights_noise_0.4"},
                                 {"float16"},
                                 {"int8", "int6", "int4"},
                                 {"int8-blocks", "int6-blocks", "int4-blocks", "int3-blocks"},
                                 {"prune_0.1", "prune_0.3", "prune_0.5", "prune_0.7", "prune_0.9"},
                                 {"hue_10", "hue_30", "hue_90", "hue_180"},
                                 {"brightness_0.8", "brightness_0.5", "brightness_0.25"},
                                 {"contrast_1.25", "contrast_1.5", "contrast_2"},
                                 {"greyscale"},
                                 {"sign_flip_0.5", "sign_flip_1", "sign_flip_1.5", "sign_flip_2"}};
const Names kAverage{"average_0.25", "average_0.5", "average_0.75"}, kCopy{"copy_0.5", "copy_1", "copy_2"};

struct Curve {
  std::string name;  // of the attack, without its severities
  std::vector<AttackRow> rows;
};

// "int8-blocks" -> "int-blocks", "noise_0.1" -> "noise"
std::string family(const std::string& name) {
  const std::size_t line = name.rfind('_');
  if (line != std::string::npos && name.find(',') == std::string::npos) return name.substr(0, line);
  std::string text = name.substr(0, name.find(','));
  if (text.starts_with("int")) text.erase(3, 1);
  return text;
}

class Bench {
 public:
  Bench(const BenchAttacksOptions& options, Context& context)
      : options_(options),
        context_(context),
        owner_(watermark::Owner::load(options.owner)),
        message_(message_of(options.message, owner_.options().bits)),
        marked_(nerf::RadianceField::load(options.field)),
        progress_(context.progress("attacks")),
        meter_(owner_, marked_, message_, meter_options()) {}

  const watermark::AttackMeter& meter() const { return meter_; }
  const nerf::RadianceField& marked() const { return marked_; }
  const watermark::Owner& owner() const { return owner_; }

  Curve images(const Names& names) {
    Curve curve{family(names.front()), {}};
    for (const std::string& name : used(names))
      curve.rows.push_back(add(name, [&] { return meter_.image(name); }));
    return curve;
  }
  // Of the marked field; or what is put onto another one, whose damage counts.
  Curve fields(const Names& names, const watermark::FieldAttackInputs& inputs,
               const nerf::RadianceField* onto = nullptr) {
    Curve curve{family(names.front()), {}};
    for (const std::string& name : used(names))
      curve.rows.push_back(add(name, [&] {
        const auto attacked = watermark::apply_field_attack(
            watermark::parse_field_attack(name), onto ? *onto : marked_, CounterRng(context_.seed()), inputs);
        return meter_.field(name, attacked, onto);
      }));
    return curve;
  }
  Curve file(const std::string& path) {
    const std::string name = std::filesystem::path(path).stem().string();
    return {name, {add(name, [&] { return meter_.field(name, nerf::RadianceField::load(path)); })}};
  }
  AttackRow none() {
    return add("none", [&] { return meter_.none(); });
  }

 private:
  watermark::AttackMeterOptions meter_options() {
    return {.cameras = nerf::make_cameras(owner_.field.cameras, nerf::parse_camera_set(options_.cameras),
                                          options_.count, options_.size, context_.seed()),
            .informed_views = options_.informed_count,
            .seed = context_.seed(),
            .progress = [this](Index done, Index total) {
              if (guard_.interrupted()) throw Interrupted("nothing was written");
              progress_.update(static_cast<double>(done) / static_cast<double>(total), now_);
              return true;
            }};
  }
  Names used(const Names& names) const { return options_.quick ? Names{names[names.size() / 2]} : names; }
  template <class F>
  AttackRow add(const std::string& name, const F& measure) {
    now_ = name;
    AttackRow row = measure();
    char line[200], informed[60] = "";
    if (meter_.informed_views() > 0)
      std::snprintf(informed, sizeof informed, "  informed %6.2f%%  chosen %6.2f%%",
                    100 * row.accuracy.informed, 100 * row.accuracy.chosen);
    std::snprintf(line, sizeof line, "%-24s %6.2f%%%s  worst 5%% %6.2f%%  p %.1e  %6.2f dB  kept %3.0f%%\n",
                  name.c_str(), 100 * row.accuracy.blind, informed, 100 * row.accuracy_p5, row.p_value,
                  row.psnr_foreground, 100 * row.kept);
    context_.text() << line;
    return row;
  }

  const BenchAttacksOptions& options_;
  Context& context_;
  const InterruptGuard guard_;
  watermark::Owner owner_;
  watermark::Message message_;
  nerf::RadianceField marked_;
  Progress progress_;
  std::string now_ = "none";
  watermark::AttackMeter meter_;
};

Json row_json(const AttackRow& row) {
  return {{"attack", row.name},
          {"blind", number(row.accuracy.blind)},
          {"informed", number(row.accuracy.informed)},
          {"chosen", number(row.accuracy.chosen)},
          {"blind_p5", number(row.accuracy_p5)},
          {"p_value", row.p_value},
          {"psnr_foreground", number(row.psnr_foreground)},
          {"kept", number(row.kept)}};
}

Json rows_json(const std::vector<Curve>& curves) {
  Json rows = Json::array();
  for (const Curve& curve : curves)
    for (const AttackRow& row : curve.rows) rows.push_back(row_json(row));
  return rows;
}

// Damage as an error in grey levels: to the right is more, as severities go.
void write_plot(const std::filesystem::path& path, const std::string& title, const char* reading,
                const std::vector<Curve>& curves) {
  std::vector<bench::ScatterPoint> points;
  for (const Curve& curve : curves)
    for (const AttackRow& row : curve.rows)
      if (std::isfinite(row.psnr_foreground))
        points.push_back({.x = 255 * std::pow(10, -row.psnr_foreground / 20),
                          .y = 100 * row.chosen(),
                          .series = curve.name});
  if (points.empty()) return;
  write_file_atomically(
      path, bench::scatter_chart({.title = title,
                                  .x = "damage on the object, rms error in grey levels (2.55: 40 dB, 8.1: 30 "
                                       "dB, 25.5: 20 dB)",
                                  .y = std::string("bits right in one view, ") + reading + ", %",
                                  .curves = true,
                                  .y_most = 100},
                                 points));
}

std::filesystem::path beside(std::filesystem::path path, const char* what) {
  return path.replace_filename(path.stem().string() + what + path.extension().string());
}

constexpr const char* kDamage =
    "psnr_foreground: attacked against marked image over the object, dB, moved back first where an attack "
    "moves pixels; kept: share of the object's pixels still shown; blind, blind_p5, p_value: from the "
    "image alone, all views; p_value: of 10 views together, median; informed: informed, of the first "
    "informed_views views; chosen: of the reading that extract would believe there, by agreement alone";

void check(const BenchAttacksOptions& o) {
  if (o.owner.empty() || !o.message.given() || o.field.empty())
    throw UsageError("bench attacks: needs --owner OWNER, --field BAKED and the --message baked into it");
  for (const std::string& path : o.attacked)
    if (!std::filesystem::exists(path)) throw IoError(path + ": no such file");
  if (o.plot.empty()) return;
  check_writable(o.plot);
  check_writable(beside(o.plot, "-fields").string());
}

}  // namespace

void add_bench_attacks(CommandLine& app, BenchAttacksOptions& o) {
  const auto add_file = [&](const char* name, auto& to, const char* what, const char* type) {
    app.add_option(name, to, what)->type_name(type)->default_str("");
  };
  add_file("--owner", o.owner, "attacks: what `fieldmark embed` wrote; embed: the owner of the field",
           "OWNER");
  add_message_options(app, o.message, "attacks: the message baked into --field");
  add_file("--other", o.other, "attacks: a field baked with another message, to be averaged with (none)",
           "FIELD");
  add_file("--onto", o.onto, "attacks: another scene's field, onto which the mark is copied (none)", "FIELD");
  add_file("--attacked", o.attacked,
           "attacks: files made from --field by other means, a row each, several times", "FIELD");
  app.add_option("--cameras", o.cameras, "attacks: near, ring, sphere (see measure)")
      ->one_of({"novel", "ring", "sphere"})
      ->type_name("SET");
  app.add_option("--count", o.count, "attacks: views, 1 to 1000")->range(1, 1000)->type_name("N");
  app.add_option(
         "--informed-count", o.informed_count,
         "attacks: of the first so many views informed is read too, 0 to 1000: seconds a view and row")
      ->range(0, 1000)
      ->type_name("N");
}

int bench_attacks(const BenchAttacksOptions& options, Context& context) {
  check(options);
  std::optional<nerf::RadianceField> other, onto;
  if (!options.other.empty()) other.emplace(nerf::RadianceField::load(options.other));
  if (!options.onto.empty()) onto.emplace(nerf::RadianceField::load(options.onto));
  Bench bench(options, context);
  const AttackRow none = bench.none();
  std::vector<Curve> images, fields;
  for (const Names& names : kImages) images.push_back(bench.images(names));
  for (const Names& names : kFields)
    fields.push_back(bench.fields(names, {.unmarked = &bench.owner().field}));
  if (other) fields.push_back(bench.fields(kAverage, {.other = &*other}));
  if (onto)
    fields.push_back(
        bench.fields(kCopy, {.unmarked = &bench.owner().field, .marked = &bench.marked()}, &*onto));
  for (const std::string& path : options.attacked) fields.push_back(bench.file(path));
  if (!options.plot.empty()) {
    const char* reading = bench.meter().informed_views() > 0 ? "as extract reads them" : "blind";
    write_plot(options.plot, "Attacks on images: what is read against the damage", reading, images);
    write_plot(beside(options.plot, "-fields"),
               "Attacks on the field's file: what is read against the damage", reading, fields);
  }
  Json unattacked = row_json(none);
  unattacked.erase("attack");
  context.result({{"field", std::filesystem::path(options.field).filename().string()},
                  {"bits", bench.owner().options().bits},
                  {"views", options.count},
                  {"informed_views", bench.meter().informed_views()},
                  {"cameras", options.cameras},
                  {"columns", kDamage},
                  {"unattacked", unattacked},
                  {"images", rows_json(images)},
                  {"fields", rows_json(fields)}});
  return kOk;
}

}  // namespace fieldmark::cli
