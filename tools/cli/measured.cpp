#include "cli/measured.h"

#include <cmath>
#include <cstdio>
#include <ostream>

#include "cli/cli.h"
#include "cli/counted.h"

namespace fieldmark::cli {

Index informed_views(std::optional<Index> given, Index usual, const watermark::Owner& owner) {
  if (owner.mark().has_cells()) return given.value_or(usual);
  if (given.value_or(0) > 0)
    throw UsageError("--informed-count: an owner of preset " + owner.mark().preset() +
                     " has no cells in space");
  return 0;
}

Json measurement_json(const watermark::Measurement& m, const std::string& cameras) {
  const auto reading = [](const watermark::ReadingAccuracy& accuracy) {
    return Json{{"blind", number(accuracy.blind)},
                {"informed", number(accuracy.informed)},
                {"chosen", number(accuracy.chosen)},
                {"found", number(accuracy.found)}};
  };
  Json distorted = Json::object();
  for (const auto& [name, accuracy] : m.under) distorted[name] = reading(accuracy);
  return {{"bits", m.bits},
          {"views", m.views},
          {"cameras", cameras},
          {"baked", m.baked},
          {"accuracy", reading(m.accuracy)},
          {"accuracy_p5", number(m.accuracy_p5)},
          {"psnr_base", number(m.psnr_base)},
          {"psnr_base_foreground", number(m.psnr_base_foreground)},
          {"ssim_base", number(m.ssim_base)},
          {"lpips_base", number(m.lpips_base)},
          {"psnr_gt", nullptr},
          {"psnr_gt_foreground", nullptr},
          {"distorted", distorted},
          {"informed_views", m.informed_views},
          {"informed_seconds", number(m.informed_seconds)},
          {"blind_seconds", number(m.blind_seconds)}};
}

Json measurement_row(const watermark::Measurement& m, const std::string& cameras) {
  const Json all = measurement_json(m, cameras);
  Json row{{"cameras", cameras}, {"views", m.views}};
  row.update(all.at("accuracy"));
  for (const char* name : {"accuracy_p5", "psnr_base", "psnr_base_foreground", "ssim_base", "lpips_base"})
    row[name] = all.at(name);
  for (const auto& [name, reading] : all.at("distorted").items())
    for (const auto& [kind, accuracy] : reading.items()) row[name + " " + kind] = accuracy;
  return row;
}

void print_measurement(std::ostream& out, const watermark::Measurement& m, const std::string& cameras) {
  const auto print = [&](const char* format, auto... values) {
    char line[200];
    std::snprintf(line, sizeof line, format, values...);
    out << line;
  };
  print("%s, %s of %s cameras, %s\n", counted(m.bits, "bit").c_str(), counted(m.views, "view").c_str(),
        cameras.c_str(), m.baked ? "baked field" : "not baked");
  if (std::isfinite(m.psnr_base))
    print("against unmarked     %.2f dB, foreground %.2f dB, ssim %.4f\n", m.psnr_base,
          m.psnr_base_foreground, m.ssim_base);
  else
    print("against unmarked     no pixel differs\n");
  if (std::isfinite(m.lpips_base)) print("                     lpips %.4f\n", m.lpips_base);
  print("bit accuracy, blind  %.2f%% per view, 5th percentile %.2f%%, %.3f s per view\n",
        100 * m.accuracy.blind, 100 * m.accuracy_p5, m.blind_seconds);
  if (m.informed_views > 0)
    print("informed             %.2f%%, chosen %.2f%%, of %s, %.3f s per view\n", 100 * m.accuracy.informed,
          100 * m.accuracy.chosen, counted(m.informed_views, "view").c_str(), m.informed_seconds);
  if (std::isfinite(m.accuracy.found))
    print("found at p %.0e     %.1f%% of single views\n", watermark::kFoundAt, 100 * m.accuracy.found);
  for (const auto& [name, accuracy] : m.under) {
    print("  %-26s %.2f%%", name.c_str(), 100 * accuracy.blind);
    if (m.informed_views > 0)
      print(", informed %.2f%%, chosen %.2f%%", 100 * accuracy.informed, 100 * accuracy.chosen);
    if (std::isfinite(accuracy.found)) print(", found %.1f%%", 100 * accuracy.found);
    out << "\n";
  }
}

watermark::Measurement run_measure(const watermark::Owner& owner, const nerf::RadianceField* baked,
                                   const watermark::Message* message, watermark::MeasureOptions options,
                                   Context& context) {
  const InterruptGuard guard;
  Progress progress = context.progress("measure");
  options.progress = [&](Index done, Index total) {
    if (guard.interrupted()) throw Interrupted("the measurement is not complete");
    progress.update(static_cast<double>(done) / static_cast<double>(total));
    return true;
  };
  return watermark::measure(owner, baked, message, options);
}

}  // namespace fieldmark::cli
