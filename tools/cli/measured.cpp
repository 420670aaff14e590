#include "cli/measured.h"

#include <fieldmark/nerf/evaluation.h>

#include <cmath>
#include <cstdio>
#include <ostream>

#include "cli/cli.h"

namespace fieldmark::cli {
namespace {

namespace wm = watermark;

Json number(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

std::vector<nerf::Camera> cameras_of(const wm::Owner& owner, const MarkMeasure& what, std::uint64_t seed) {
  if (what.cameras != "test")
    return nerf::make_cameras(owner.field.cameras, nerf::parse_camera_set(what.cameras), what.count,
                              what.size, seed + 1000);
  if (what.data.empty()) throw UsageError("--cameras test: needs --data DIR, whose views they are");
  std::vector<nerf::Camera> cameras;
  for (const auto& view : nerf::load_dataset(what.data, {.split = "test"}).views)
    cameras.push_back(view.camera.scaled(what.size));
  return cameras;
}

// PSNR against the photographs of the test views: of the field that is measured, and of the unmarked one.
Json photo(const wm::Owner& owner, const MarkMeasure& what) {
  if (what.data.empty()) return {{"psnr_photo", nullptr}, {"psnr_photo_unmarked", nullptr}};
  const auto data = nerf::load_dataset(
      what.data, {.split = "test", .size = what.size, .background = owner.field.background});
  Json json{{"psnr_photo", nullptr}};
  if (what.baked) json["psnr_photo"] = nerf::evaluate(*what.baked, data).mean.psnr;
  json["psnr_photo_unmarked"] = nerf::evaluate(owner.field, data).mean.psnr;
  return json;
}

void print(const wm::Measurement& m, const std::string& cameras, std::ostream& out) {
  char line[160];
  std::snprintf(line, sizeof line, "%lld bits, %lld views of '%s', %s\n", static_cast<long long>(m.bits),
                static_cast<long long>(m.views), cameras.c_str(),
                m.baked ? "baked field" : "random message a view");
  out << line;
  std::snprintf(line, sizeof line, "  against unmarked: %.2f dB whole picture, %.2f dB object, SSIM %.4f\n",
                m.psnr_base, m.psnr_base_object, m.ssim_base);
  out << line;
  std::snprintf(line, sizeof line, "  %-16s %6.2f%% of bits right in one view (5th percentile %.1f%%)\n",
                "none", 100 * m.accuracy.blind, 100 * m.accuracy_p5);
  out << line;
  for (const auto& [name, accuracy] : m.under) {
    std::snprintf(line, sizeof line, "  %-16s %6.2f%%\n", name.c_str(), 100 * accuracy.blind);
    out << line;
  }
}

}  // namespace

Json measure_mark(const wm::Owner& owner, const MarkMeasure& what, Context& context) {
  wm::MeasureOptions options{.cameras = cameras_of(owner, what, context.seed()),
                             .under = what.under,
                             .seed = context.seed(),
                             .progress = {}};
  const InterruptGuard guard;
  wm::Measurement m;
  {
    Progress progress = context.progress("measure");
    options.progress = [&](Index done, Index total) {
      progress.update(static_cast<double>(done) / static_cast<double>(total));
      if (guard.interrupted()) throw Interrupted("while measuring");
      return true;
    };
    m = read_option("--under", [&] { return wm::measure(owner, what.baked, what.message, options); });
  }
  print(m, what.cameras, context.text());
  Json json{{"bits", m.bits},
            {"views", m.views},
            {"cameras", what.cameras},
            {"baked", m.baked},
            {"accuracy", {{"blind", m.accuracy.blind}, {"geometry", nullptr}}},
            {"accuracy_p5", m.accuracy_p5},
            {"psnr_base", number(m.psnr_base)},
            {"psnr_base_object", number(m.psnr_base_object)},
            {"ssim_base", number(m.ssim_base)},
            {"lpips_base", nullptr}};
  json.update(photo(owner, what));
  json["under"] = Json::object();
  for (const auto& [name, accuracy] : m.under)
    json["under"][name] = {{"blind", accuracy.blind}, {"geometry", nullptr}};
  return json;
}

wm::Message read_message(const std::string& hex, const wm::Owner& owner) {
  return read_option("--message", [&] { return wm::message_from_hex(hex, owner.options().bits); });
}

}  // namespace fieldmark::cli
