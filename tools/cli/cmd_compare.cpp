#include <fieldmark/core/error.h>
#include <fieldmark/core/files.h>
#include <fieldmark/core/worst.h>
#include <fieldmark/imaging/image.h>
#include <fieldmark/imaging/metrics.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <ostream>

#include "cli/cli.h"
#include "cli/commands.h"
#include "cli/context.h"
#include "cli/images.h"
#include "cli/lpips.h"
#include "cli/shared_data.h"

namespace fieldmark::cli {
namespace {

constexpr Index kSsimWindow = 11;
constexpr double kReferenceBar = 1e-4;  // tolerance of LPIPS

struct CompareArguments {
  std::vector<std::string> paths;
  std::string alex, squeeze;
  bool reference = false;
};

struct Scores {
  double psnr, ssim, alex, squeeze;
};

struct Networks {
  std::optional<Lpips<float>> alex, squeeze;
  Scores compare(const Tensor<float>& a, const Tensor<float>& b) const {
    const bool large = std::min(a.shape[0], a.shape[1]) >= kSsimWindow;
    return {psnr(a, b), large ? ssim(a, b) : std::nan(""), lpips_or_nan(alex, a, b),
            lpips_or_nan(squeeze, a, b)};
  }
};

void print(Context& context, const std::string& name, const Scores& s) {
  char line[120];
  std::snprintf(line, sizeof line, " %7.2f dB  ssim %.4f  lpips alex %.5f  squeeze %.5f\n", s.psnr, s.ssim,
                s.alex, s.squeeze);
  context.text() << name << std::string(name.size() < 24 ? 24 - name.size() : 0, ' ') << line;
}

Json json_of(const Scores& s) {
  return {{"psnr", number(s.psnr)},
          {"ssim", number(s.ssim)},
          {"lpips_alex", number(s.alex)},
          {"lpips_squeeze", number(s.squeeze)}};
}

int compare(const CompareArguments& options, const Networks& networks, Context& context) {
  const auto left = list_images({options.paths[0]}, context),
             right = list_images({options.paths[1]}, context);
  if (left.size() != right.size())
    throw IoError(options.paths[1] + ": expected " + std::to_string(left.size()) + " images, as " +
                  options.paths[0] + " has, found " + std::to_string(right.size()));
  Scores mean{};
  Json pairs = Json::array();
  const auto count = static_cast<double>(left.size());
  for (std::size_t i = 0; i < left.size(); ++i) {
    const auto a = read_rgb(left[i], 1), b = read_rgb(right[i], 1);
    if (a.shape != b.shape)
      throw IoError(right[i].string() + ": expected the size of " + left[i].string() + ", " + a.shape.str() +
                    ", found " + b.shape.str());
    const Scores s = networks.compare(a, b);
    print(context, left[i].filename().string(), s);
    Json row{{"a", left[i].filename().string()}, {"b", right[i].filename().string()}};
    row.update(json_of(s));
    pairs.push_back(row);
    mean.psnr += s.psnr / count;
    mean.ssim += s.ssim / count;
    mean.alex += s.alex / count;
    mean.squeeze += s.squeeze / count;
  }
  if (left.size() > 1) print(context, "mean", mean);
  Json json = json_of(mean);
  json["pairs"] = pairs;
  context.result(json);
  return kOk;
}

std::filesystem::path reference_folder(const CompareArguments& options) {
  if (!options.paths.empty()) return options.paths[0];
  auto folder = shared_data("lpips_reference");
  if (folder.empty()) throw UsageError("--reference: needs a folder, or FIELDMARK_DATA");
  return folder;
}

Json read_reference(const std::filesystem::path& path) {
  const std::string text = read_text(path);
  try {
    return Json::parse(text);
  } catch (const Json::exception& e) {
    throw IoError(path.string() + ": expected JSON, found: " + e.what());
  }
}

// Returns one row: LPIPS of a pair by one network, next to the reference.
Json reference_row(const Json& pair, const char* name, const Lpips<float>& lpips, const Tensor<float>& a,
                   const Tensor<float>& b) {
  const LpipsDistance d = lpips.distance(a, b);
  const Json& want = pair.at(name);
  const auto layers = want.at("per_layer_f32").get<std::vector<double>>();
  double off = layers.size() == d.per_layer.size() ? 0 : std::nan("");
  for (std::size_t k = 0; k < std::min(layers.size(), d.per_layer.size()); ++k)
    raise_to(off, std::abs(d.per_layer[k] - layers[k]));
  const double value = want.at("value_f64");
  return {{"pair", pair.at("name")},
          {"network", name},
          {"lpips", d.value},
          {"reference", value},
          {"error", std::abs(d.value - value)},
          {"worst_layer_error", off},
          {"psnr", number(psnr(a, b))},
          {"psnr_error", std::abs(psnr(a, b) - pair.at("psnr_db").get<double>())},
          {"ssim", ssim(a, b)}};
}

int compare_with_reference(const CompareArguments& options, const Networks& networks, Context& context) {
  if (!networks.alex || !networks.squeeze)
    throw UsageError("--reference: needs both networks' weights, see --lpips-weights and --squeeze-weights");
  const auto folder = reference_folder(options);
  const std::string file = (folder / "lpips_reference.json").string();
  const Json reference = read_reference(file);
  Json rows = Json::array();
  try {
    for (const Json& pair : reference.at("pairs")) {
      const auto a = read_rgb(folder / pair.at("a").get<std::string>(), 1),
                 b = read_rgb(folder / pair.at("b").get<std::string>(), 1);
      rows.push_back(reference_row(pair, "alex", *networks.alex, a, b));
      rows.push_back(reference_row(pair, "squeeze", *networks.squeeze, a, b));
    }
  } catch (const Json::exception& e) {
    throw IoError(file + ": expected pairs with their values, found: " + e.what());
  }
  if (rows.empty()) throw IoError(file + ": expected pairs, found none");
  Json json{{"reference", reference.value("convention", "not stated")}, {"bar", kReferenceBar}};
  for (const char* key : {"error", "worst_layer_error", "psnr_error"}) {
    double worst = 0;
    for (const Json& row : rows) raise_to(worst, row[key].get<double>());
    json[std::string(key) == "worst_layer_error" ? key : "worst_" + std::string(key)] = worst;
  }
  json["pairs"] = rows;
  char line[200];
  for (const Json& row : rows) {
    std::snprintf(line, sizeof line, "%-22s %-8s lpips %.7f  reference %.7f  error %.1e\n",
                  row["pair"].get<std::string>().c_str(), row["network"].get<std::string>().c_str(),
                  row["lpips"].get<double>(), row["reference"].get<double>(), row["error"].get<double>());
    context.text() << line;
  }
  double worst = json["worst_error"].get<double>();
  raise_to(worst, json["worst_layer_error"].get<double>());
  std::snprintf(line, sizeof line, "largest error, total or per layer: %.1e (limit %.0e)\n", worst,
                kReferenceBar);
  context.text() << line;
  context.result(json);
  return worst <= kReferenceBar ? kOk : kFailed;
}

int run_compare(const CompareArguments& options, Context& context) {
  if (!options.reference && options.paths.size() != 2)
    throw UsageError("expected two images or folders, got " + std::to_string(options.paths.size()));
  if (options.reference && options.paths.size() > 1)
    throw UsageError("--reference: expected at most one folder, got " + std::to_string(options.paths.size()));
  const Networks networks{load_lpips(LpipsNetwork::alex, options.alex, context),
                          load_lpips(LpipsNetwork::squeeze, options.squeeze, context)};
  return options.reference ? compare_with_reference(options, networks, context)
                           : compare(options, networks, context);
}

}  // namespace

Command add_compare(CommandLine& app) {
  auto o = std::make_shared<CompareArguments>();
  app.add_option("images", o->paths,
                 "Two images, or two folders whose images are paired in order; PNG, JPEG, WebP, AVIF, HEIC")
      ->type_name("IMAGE|DIR")
      ->default_str("");
  add_lpips_weights(app, o->alex);
  app.add_option("--squeeze-weights", o->squeeze,
                 "SqueezeNet weights of LPIPS, or none to skip it;\n"
                 "default: $FIELDMARK_DATA/weights/lpips_squeeze_v0.1.safetensors")
      ->type_name("FILE")
      ->default_str("");
  app.add_flag(
      "--reference", o->reference,
      "Compare LPIPS with reference values in a folder instead, default $FIELDMARK_DATA/lpips_reference;\n"
      "fails if an error exceeds 1e-4");
  return [o](Context& context) { return run_compare(*o, context); };
}

}  // namespace fieldmark::cli
