#include <fieldmark/nerf/evaluation.h>
#include <fieldmark/watermark/attacks/payload_trials.h>

#include <algorithm>
#include <cstdio>
#include <memory>
#include <optional>
#include <ostream>
#include <span>

#include "cli/cli.h"
#include "cli/code_option.h"
#include "cli/commands.h"
#include "cli/context.h"
#include "cli/counted.h"
#include "cli/lpips.h"
#include "cli/measured.h"
#include "cli/scene_data.h"

namespace fieldmark::cli {
namespace {

struct MeasureArguments {
  std::string owner, field, data, lpips_weights;
  MessageOption message;
  CodeOption code;
  std::vector<std::string> cameras{"novel"};
  Index count = 200, size = 0, together = 1;
  std::optional<Index> informed_count;
  bool payloads = false, count_given = false;
  std::vector<std::string> under;
};

std::vector<nerf::Camera> measured_cameras(const std::string& set, const MeasureArguments& options,
                                           const watermark::Owner& owner, Context& context) {
  if (set != "test")
    return nerf::make_cameras(owner.field.cameras, nerf::parse_camera_set(set), options.count, options.size,
                              context.seed());
  if (options.data.empty()) throw UsageError("--cameras test: needs --data DIR");
  std::vector<nerf::Camera> cameras;
  for (const auto& view : load_scene(options.data, {.split = "test"}, context).views)
    cameras.push_back(view.camera.scaled(options.size));
  return cameras;
}

// Evaluates against the ground truth, separately from the figures against the unmarked field.
nerf::Evaluation against_ground_truth(const MeasureArguments& options, const nerf::RadianceField& field,
                                      const char* what, Context& context) {
  const auto data = load_scene(
      options.data, {.split = "test", .size = options.size, .background = field.background}, context);
  nerf::Renderer renderer(field);
  const InterruptGuard guard;
  Progress progress = context.progress(what);
  return nerf::evaluate(renderer, data, [&](Index done, Index total) {
    if (guard.interrupted()) throw Interrupted("the measurement is not complete");
    progress.update(static_cast<double>(done) / static_cast<double>(total));
    return true;
  });
}

// Reports payloads separately from raw bits: bits belong to a view, payloads to a corrected group of views.
Json payloads_json(Index together, const watermark::PayloadViews& views, Context& context) {
  Json json = nullptr, under = Json::object();
  for (const auto& [name, a] : views.accuracies()) {
    const auto [low, high] = watermark::wilson_interval(a.exact, a.trials);
    const double corrected = static_cast<double>(a.corrected) / static_cast<double>(a.exact);
    const Json figures{{"trials", a.trials}, {"exact", number(a.share())}, {"exact_low", low},
                       {"exact_high", high}, {"wrong", a.wrong},           {"corrected", number(corrected)}};
    (name.empty() ? json : under[name]) = figures;
    char line[200];
    std::snprintf(line, sizeof line,
                  "%-20s %.2f%% exact (95%%: %.2f to %.2f%%) of %lld readings of %lld views, %lld wrong\n",
                  name.empty() ? "payload" : ("  after " + name).c_str(), 100 * a.share(), 100 * low,
                  100 * high, static_cast<long long>(a.trials), static_cast<long long>(together),
                  static_cast<long long>(a.wrong));
    context.text() << line;
  }
  if (json.is_null()) return json;
  json["together"] = together;
  json["distorted"] = under;
  return json;
}

// Counts payloads of groups of views and, if groups have several views, of single views too.
class PayloadCounts {
 public:
  PayloadCounts(const watermark::CellCode& code, Index bits, Index together)
      : together_(together), groups_(code, bits, together), singles_(code, bits, 1) {}
  void add(Index view, const std::string& under, std::span<const double> evidence,
           const watermark::Message& sent) {
    groups_.add(view, under, evidence, sent);
    if (together_ > 1) singles_.add(view, under, evidence, sent);
  }
  Json json(Context& context) const {
    Json json = payloads_json(together_, groups_, context);
    if (!json.is_null() && together_ > 1) json["single"] = payloads_json(1, singles_, context);
    return json;
  }

 private:
  Index together_;
  watermark::PayloadViews groups_, singles_;
};

// Returns random payloads instead of random messages, one per group of views.
std::function<watermark::Message(Index)> messages_of(const MeasureArguments& options,
                                                     const watermark::PayloadCodec& codec,
                                                     std::uint64_t seed) {
  if (!options.payloads) return {};
  if (!options.field.empty()) throw UsageError("--payloads: a baked field has one message");
  const CounterRng rng(seed, 43);
  const auto message = [&codec, rng, together = options.together](Index view) {
    return codec.encode(watermark::random_payload(codec, rng, static_cast<std::uint64_t>(view / together)));
  };
  read_option("--payloads", [&] { return message(0); });
  return message;
}

struct MeasureSubject {
  watermark::Owner owner;
  std::optional<nerf::RadianceField> baked;
  std::optional<watermark::Message> message;
};

// Figures of one set of cameras, plus a row if there are several sets.
struct Measured {
  Json json, row;
};

Measured measured_on(const std::string& set, const std::vector<nerf::Camera>& cameras,
                     const MeasureArguments& options, const MeasureSubject& subject,
                     const Lpips<float>* lpips, Context& context) {
  const Index bits = subject.owner.options().bits;
  if (options.together > static_cast<Index>(cameras.size()))
    throw UsageError("--together: there are only " + counted(std::ssize(cameras), "view"));
  const watermark::PayloadCodec codec(bits);
  const auto code = subject.owner.code();
  PayloadCounts payloads(code, bits, options.together);
  const auto measured = run_measure(
      subject.owner, subject.baked ? &*subject.baked : nullptr, subject.message ? &*subject.message : nullptr,
      {.cameras = cameras,
       .under = options.under,
       .informed_views = informed_views(options.informed_count, 20, subject.owner),
       .seed = context.seed(),
       .messages = messages_of(options, codec, context.seed()),
       .on_reading = [&](Index view, const std::string& under, const auto& evidence,
                         const auto& sent) { payloads.add(view, under, evidence, sent); },
       .lpips = lpips,
       .progress = {}},
      context);
  print_measurement(context.text(), measured, set);
  Json json = measurement_json(measured, set);
  json["payload"] = payloads.json(context);
  return {json, measurement_row(measured, set)};
}

void add_ground_truth(const MeasureArguments& options, const MeasureSubject& subject, Json& json,
                      Context& context) {
  const auto marked = against_ground_truth(options, *subject.baked, "ground truth", context);
  const auto unmarked = against_ground_truth(options, subject.owner.field, "ground truth, unmarked", context);
  char line[160];
  std::snprintf(line, sizeof line,
                "against ground truth %.2f dB (foreground %.2f), unmarked field %.2f dB (%.2f)\n",
                marked.psnr, marked.psnr_foreground, unmarked.psnr, unmarked.psnr_foreground);
  context.text() << line;
  json["psnr_gt"] = number(marked.psnr);
  json["psnr_gt_foreground"] = number(marked.psnr_foreground);
  json["psnr_gt_unmarked"] = number(unmarked.psnr);
  json["psnr_gt_unmarked_foreground"] = number(unmarked.psnr_foreground);
}

int run_measure(const MeasureArguments& options, Context& context) {
  if (options.message.given() == options.field.empty())
    throw UsageError(options.field.empty() ? "--message: needs --field"
                                           : "--field: needs the message baked into it, see --message");
  const bool test = std::ranges::count(options.cameras, "test") > 0;
  if (!options.data.empty() && !test && options.field.empty())
    throw UsageError("--data: needs --field or --cameras test");
  if (options.count_given && test && options.cameras.size() == 1)
    throw UsageError("--count: --cameras test takes all test cameras of --data");
  for (const auto& name : options.under)
    read_option("--distort", [&] { return distort::parse_distortion(name); });
  const auto lpips = load_lpips(LpipsNetwork::alex, options.lpips_weights, context);
  MeasureSubject subject{watermark::Owner::load(options.owner), {}, {}};
  choose_code(options.code, options.message, subject.owner, context);
  if (const Index bits = subject.owner.options().bits; bits > kMostPayloadBits)
    throw UsageError("--bits: measure takes messages of at most " + std::to_string(kMostPayloadBits) +
                     " bits, got " + std::to_string(bits));
  if (options.together > 1 && options.field.empty() && !options.payloads)
    throw UsageError("--together: needs --payloads, or a --field whose message is a payload");
  if (!options.field.empty()) {
    subject.message = message_of(options.message, subject.owner.options().bits);
    if (options.together > 1 && payload_json(*subject.message).is_null())
      throw UsageError("--together: the message of --field is not a payload");
    subject.baked.emplace(nerf::RadianceField::load(options.field));
  }
  std::vector<std::vector<nerf::Camera>> cameras;
  for (const auto& set : options.cameras)
    cameras.push_back(measured_cameras(set, options, subject.owner, context));
  Json json, rows = Json::array();
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const Measured on =
        measured_on(options.cameras[i], cameras[i], options, subject, lpips ? &*lpips : nullptr, context);
    if (i == 0) json = on.json;
    rows.push_back(on.row);
  }
  if (subject.baked && !options.data.empty()) add_ground_truth(options, subject, json, context);
  if (cameras.size() > 1) json["rows"] = rows;
  context.result(json);
  return kOk;
}

}  // namespace

Command add_measure(CommandLine& app) {
  auto o = std::make_shared<MeasureArguments>();
  app.add_option("--owner", o->owner, "Owner file from `fieldmark embed`")->required()->type_name("OWNER");
  app.add_option("--field", o->field, "Baked field to measure; default: the mark as trained")
      ->type_name("FIELD")
      ->default_str("");
  add_message_options(app, o->message, "Message of the baked field");
  add_code_options(app, o->code);
  add_copy_option(app, o->code, "Recipient of the baked copy");
  app.add_option("--cameras", o->cameras,
                 "Cameras to measure from, separated by commas, one row each: "
                 "novel (from the span of the training cameras), "
                 "ring (elevation 30 degrees, radius 4.0311 units of the scene), sphere (all directions), "
                 "extrapolated (over 30 degrees from every training direction where there are any), "
                 "closer and farther (as novel, at other distances), "
                 "test (of --data)")
      ->delimiter(',')
      ->one_of(nerf::camera_set_names())
      ->type_name("SET")
      ->default_str("novel");
  const Option count =
      app.add_option(
             "--count", o->count,
             "Views to draw per set of cameras, 1 to 100000; each has its own random message unless baked")
          ->range(1, 100000)
          ->type_name("N");
  app.add_option("--informed-count", o->informed_count,
                 "Views to read by informed detection as well, 0 to 100000; takes up to a second per view "
                 "and distortion, some 4 s where the view does not agree with the field or gaps divide it; "
                 "default: 20, or 0 "
                 "for marks without cells")
      ->range(0, 100000)
      ->type_name("N")
      ->default_str("");
  app.add_option("--size", o->size, "Longer side of the views in pixels, 16 to 8192; default: as trained")
      ->range(16, 8192)
      ->type_name("N")
      ->default_str("");
  app.add_option(
         "--distort", o->under,
         "Chain of distortions to measure as well, see `fieldmark distort --help`; not h264_A; repeatable")
      ->type_name("NAME[,NAME...]")
      ->default_str("");
  app.add_option("--data", o->data,
                 "Data set for --cameras test and, with --field, for the PSNR against the ground truth")
      ->type_name("DIR");
  app.add_flag("--payloads", o->payloads,
               "Draw payloads of up to 40 bits instead of raw messages, and count exact readings");
  app.add_option("--together", o->together,
                 "Views of one message whose evidence is added before a payload is read, 1 to 10000;\n"
                 "above 1, single views are read too")
      ->range(1, 10000)
      ->type_name("N");
  add_lpips_weights(app, o->lpips_weights);
  return [o, count](Context& context) {
    o->count_given = count.count() > 0;
    return run_measure(*o, context);
  };
}

}  // namespace fieldmark::cli
