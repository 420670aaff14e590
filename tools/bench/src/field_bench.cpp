#include <fieldmark/core/error.h>
#include <fieldmark/engine/random.h>
#include <fieldmark/tools/bench/field_bench.h>
#include "field_errors.h"
#include "field_reference.h"
#include "timing.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>

namespace fieldmark::bench {
namespace {

using Cameras = std::vector<nerf::Camera>;
using Say = std::function<void(const std::string&, double)>;
constexpr double kSlow = 6;  // variants slower than the default by this factor are timed once

void compare(const nerf::Rendering& view, const std::vector<double>& want, FieldErrors& errors) {
  for (Index p = 0; p < view.opacity.size(); ++p) {
    const double* w = &want[static_cast<std::size_t>(4 * p)];
    for (Index a = 0; a < 3; ++a) errors.add(static_cast<double>(view.rgb[3 * p + a]) - w[a]);
    errors.drop(w[3] - static_cast<double>(view.opacity[p]));
  }
}

// Returns the mean time per view of a variant; with `errors`, also measures the errors.
double render_views(const nerf::RadianceField& field, const Cameras& cameras, const FieldVariant& variant,
                    const std::vector<std::vector<double>>& want, FieldErrors* errors) {
  std::unique_ptr<nerf::RadianceField> other;
  if (variant.occupancy > 0 || !variant.skip_empty)
    other = std::make_unique<nerf::RadianceField>(with_variant(field, variant));
  nerf::Renderer renderer(other ? *other : field, variant.render);
  double seconds = 0;
  renderer.render(cameras.front());  // warm-up: buffers grow, caches fill
  for (std::size_t v = 0; v < cameras.size(); ++v) {
    const double begin = now();
    const nerf::Rendering view = renderer.render(cameras[v]);
    seconds += now() - begin;
    if (errors) compare(view, want[v], *errors);
  }
  return seconds / static_cast<double>(cameras.size());
}

OccupancyCost occupancy_cost(const nerf::RadianceField& field, const Cameras& cameras,
                             const std::vector<std::vector<double>>& want, const FieldBenchOptions& options,
                             const Say& say) {
  FieldReference without(field, {.samples = options.samples, .occupancy = false});
  const CounterRng rng(options.seed);
  FieldErrors errors;
  for (std::size_t v = 0; v < cameras.size(); ++v) {
    say("reference without occupancy", 0);
    const Index all = cameras[v].width * cameras[v].height;
    std::vector<Index> pixels = permutation(all, rng, v);
    pixels.resize(static_cast<std::size_t>(std::min(options.unmasked_pixels, all)));
    const std::vector<double> whole = without.trace(cameras[v], pixels);
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      const double* w = &want[v][static_cast<std::size_t>(4 * pixels[i])];
      for (std::size_t a = 0; a < 3; ++a) errors.add(w[a] - whole[4 * i + a]);
      errors.drop(whole[4 * i + 3] - w[3]);
    }
  }
  return {static_cast<Index>(errors.pixels), errors.psnr(), errors.worst, errors.dropped / errors.pixels,
          errors.dropped_most};
}

// Times each variant right after the default and divides by the default's time, because the speed of a
// shared machine drifts.
void time_variants(const nerf::RadianceField& field, const Cameras& cameras,
                   const std::vector<std::vector<double>>& want, int runs, const Say& say,
                   std::vector<FieldRow>& rows) {
  std::vector<double> usual;
  std::vector<std::vector<double>> ratios(rows.size());
  for (int run = 0; run < runs; ++run)
    for (std::size_t i = 0; i < rows.size(); ++i) {
      FieldRow& row = rows[i];
      if (run > 0 && ratios[i].front() > kSlow) continue;
      say(row.variant.knob + " " + row.variant.setting,
          (static_cast<double>(run) + static_cast<double>(i) / static_cast<double>(rows.size())) / runs);
      FieldErrors errors;
      usual.push_back(render_views(field, cameras, rows.front().variant, want, nullptr));
      ratios[i].push_back(render_views(field, cameras, row.variant, want, run == 0 ? &errors : nullptr) /
                          usual.back());
      if (run > 0) continue;
      row.psnr = errors.psnr();
      row.max_error = errors.worst;
      row.dropped_mean = errors.dropped / errors.pixels;
      row.dropped_max = errors.dropped_most;
    }
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const double ratio = i == 0 ? 1 : median(ratios[i]);
    rows[i].seconds = ratio * median(usual);
    const auto [least, most] = std::minmax_element(ratios[i].begin(), ratios[i].end());
    rows[i].spread = (*most - *least) / ratio;
  }
}

}  // namespace

FieldBench run_field_bench(const nerf::RadianceField& field, const Cameras& cameras,
                           const FieldBenchOptions& options, const Say& progress) {
  if (cameras.empty()) throw ValueError("[field_bench] cameras must not be empty");
  if (options.runs < 1 || options.unmasked_pixels < 1)
    throw ValueError("[field_bench] runs and unmasked_pixels must be at least 1, got " +
                     std::to_string(options.runs) + " and " + std::to_string(options.unmasked_pixels));
  const Say say = progress ? progress : [](const std::string&, double) {};
  FieldBench result;
  std::vector<std::vector<double>> want;
  FieldReference reference(field, {.samples = options.samples});
  const double begin = now();
  for (const nerf::Camera& camera : cameras) {
    say("reference", 0);
    want.push_back(reference.render(camera));
  }
  result.reference_seconds = (now() - begin) / static_cast<double>(cameras.size());
  result.occupancy = occupancy_cost(field, cameras, want, options, say);
  for (const FieldVariant& v : field_variants(field, options.quick)) {
    const auto side = static_cast<double>(v.occupancy > 0 ? v.occupancy : field.grid.resolution());
    result.rows.push_back({.variant = v, .grid_bytes = side * side * side / 8});
  }
  time_variants(field, cameras, want, options.runs, say, result.rows);
  std::vector<SpeedQuality> points;
  for (const FieldRow& row : result.rows) points.push_back({row.seconds, row.psnr, row.grid_bytes});
  const std::vector<bool> front = pareto_front(points, options.margin);
  for (std::size_t i = 0; i < front.size(); ++i) result.rows[i].front = front[i];
  return result;
}

std::string judgement(const FieldBench& bench, const ParetoMargin& margin) {
  if (bench.rows.empty()) throw ValueError("[judgement] rows must not be empty");
  const FieldRow& usual = bench.rows.front();
  const auto line = [](const char* format, auto... values) {
    char text[240];
    std::snprintf(text, sizeof text, format, values...);
    return std::string(text);
  };
  const auto name = [](const FieldRow& row) { return row.variant.knob + " " + row.variant.setting; };
  // The most exact of the faster variants, and the fastest of the more exact ones.
  const FieldRow *faster = nullptr, *better = nullptr;
  for (const FieldRow& row : bench.rows) {
    if (row.seconds < (1 - margin.time) * usual.seconds && (!faster || row.psnr > faster->psnr))
      faster = &row;
    if (row.psnr > usual.psnr + margin.psnr && (!better || row.seconds < better->seconds)) better = &row;
  }
  std::string text = line("The default (%s) takes %.3g s a view at %.1f dB. ", usual.variant.setting.c_str(),
                          usual.seconds, usual.psnr);
  text += usual.front ? "It is on the front: " : "It is not on the front: ";
  text += faster ? line(
                       "the most exact of what is more than %.0f%% faster, %s, takes %.2f of its time and is "
                       "%.1f dB %s it%s; ",
                       100 * margin.time, name(*faster).c_str(), faster->seconds / usual.seconds,
                       std::abs(faster->psnr - usual.psnr), faster->psnr < usual.psnr ? "below" : "above",
                       faster->grid_bytes > usual.grid_bytes
                           ? line(", with %.0f times the grid", faster->grid_bytes / usual.grid_bytes).c_str()
                           : "")
                 : line("nothing is more than %.0f%% faster; ", 100 * margin.time);
  text += better ? line("the fastest of what is more exact, %s, takes %.2f times as long for %.1f dB more.",
                        name(*better).c_str(), better->seconds / usual.seconds, better->psnr - usual.psnr)
                 : std::string("nothing is more exact.");
  return text;
}

}  // namespace fieldmark::bench
