#include <fieldmark/core/error.h>
#include <fieldmark/imaging/pareto.h>
#include <fieldmark/tools/bench/embed_bench.h>
#include <fieldmark/watermark/attacks/measurement.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>

namespace fieldmark::bench {
namespace {

using watermark::CachedView;
using watermark::Owner;
using Say = std::function<void(const std::string&, double)>;

constexpr Index kOnTheWay = 24;  // views that calibrate the mark PSNR before an intermediate result

// A clock that starts at a given time and can be paused.
class Clock {
 public:
  explicit Clock(double seconds = 0) : before_(seconds) {}
  double seconds() const { return before_ + (runs_ ? since() : 0); }
  template <class F>
  void pause_for(F work) {
    before_ += since();
    runs_ = false;
    work();
    runs_ = true;
    begin_ = Now::now();
  }

 private:
  using Now = std::chrono::steady_clock;
  double since() const { return std::chrono::duration<double>(Now::now() - begin_).count(); }
  double before_;
  bool runs_ = true;
  Now::time_point begin_ = Now::now();
};

// Cached views, shared by variants.
class Caches {
 public:
  struct Cache {
    watermark::EmbedViewOptions options;
    watermark::PatchSize patch{};
    std::uint64_t seed = 0;
    std::vector<CachedView> views{};
    double seconds = 0;
  };
  explicit Caches(const nerf::RadianceField& field) : field_(field) {}
  // Keeps the views of the first variant and of the last one used: views are large.
  const Cache& get(const EmbedVariant& v, const std::function<void()>& stop_or_go) {
    for (const Cache& c : kept_)
      if (c.options == v.recipe.views && c.patch == v.recipe.owner.patch() && c.seed == v.recipe.embed.seed)
        return c;
    if (kept_.size() == 2) kept_.pop_back();
    kept_.reserve(2);
    Cache& c = kept_.emplace_back(
        Cache{.options = v.recipe.views, .patch = v.recipe.owner.patch(), .seed = v.recipe.embed.seed});
    const Clock clock;
    c.views = watermark::cache_embed_views(field_, c.patch, c.options, c.seed, [&](Index, Index) {
      stop_or_go();
      return true;
    });
    c.seconds = clock.seconds();
    return c;
  }

 private:
  const nerf::RadianceField& field_;
  std::vector<Cache> kept_;
};

// The same key for every run: the figures do not depend on the owner.
watermark::Key bench_key() {
  std::array<std::uint8_t, 32> bytes{};
  bytes.fill(0x5a);
  return watermark::key_from_bytes(bytes);
}

watermark::Measurement judged(const Owner& owner, nerf::CameraSet set, Index views,
                              const EmbedBenchOptions& options, const std::function<void()>& stop_or_go) {
  return watermark::measure(
      owner, nullptr, nullptr,
      {.cameras = nerf::make_cameras(owner.field.cameras, set, views, options.size, options.seed + 1),
       .seed = options.seed,
       .progress = [&](Index, Index) {
         stop_or_go();
         return true;
       }});
}

EmbedRow embedded(const nerf::RadianceField& field, const EmbedVariant& v, const Caches::Cache& cache,
                  const EmbedBenchOptions& options, const std::function<void()>& stop_or_go) {
  EmbedRow row{.variant = v, .cache_seconds = cache.seconds};
  const Index few = std::max<Index>(1, options.views / 3);
  Clock clock(cache.seconds);
  Owner owner = v.recipe.make(field, bench_key(), cache.views);
  watermark::Embedder embedder(owner, cache.views, v.recipe.embed);
  const ScheduleOptions& length = v.recipe.embed.schedule;
  for (Index next = 1; !embedder.done();) {
    stop_or_go();
    embedder.step(clock.seconds());
    const double part = length.steps > 0
                            ? static_cast<double>(embedder.steps()) / static_cast<double>(length.steps)
                            : clock.seconds() / length.seconds;
    if (next >= options.points || part < static_cast<double>(next) / static_cast<double>(options.points))
      continue;
    ++next;
    clock.pause_for([&] {
      embedder.calibrate(kOnTheWay);
      const auto m = judged(owner, nerf::CameraSet::novel, few, options, stop_or_go);
      row.curve.push_back({clock.seconds(), m.accuracy.blind, m.psnr_base_foreground});
    });
  }
  embedder.calibrate();
  row.seconds = clock.seconds();
  row.steps = embedder.steps();
  row.figures = embedder.figures();
  const auto near = judged(owner, nerf::CameraSet::novel, options.views, options, stop_or_go);
  const auto blind = [&](nerf::CameraSet set) {
    return judged(owner, set, few, options, stop_or_go).accuracy.blind;
  };
  row.accuracy = near.accuracy.blind;
  row.accuracy_p5 = near.accuracy_p5;
  row.psnr_foreground = near.psnr_base_foreground;
  row.closer = blind(nerf::CameraSet::closer);
  row.farther = blind(nerf::CameraSet::farther);
  row.extrapolated = blind(nerf::CameraSet::extrapolated);
  row.curve.push_back({row.seconds, row.accuracy, row.psnr_foreground});
  return row;
}

std::vector<double> figures_of(const EmbedRow& row) {
  return {-std::log(row.seconds), row.accuracy, row.psnr_foreground};
}

std::vector<double> margins_of(const EmbedMargin& margin) {
  return {-std::log1p(-margin.time), margin.accuracy, margin.psnr};
}

}  // namespace

std::vector<EmbedRow> run_embed_bench(const nerf::RadianceField& field,
                                      const std::vector<EmbedVariant>& variants,
                                      const EmbedBenchOptions& options, const Say& progress) {
  if (options.views < 1 || options.points < 1)
    throw ValueError("[embed_bench] views and points must be at least 1, got " +
                     std::to_string(options.views) + " and " + std::to_string(options.points));
  Caches caches(field);
  std::vector<EmbedRow> rows;
  for (const EmbedVariant& v : variants) {
    const auto stop_or_go = [&] {
      if (progress)
        progress(v.choice + ": " + v.setting,
                 static_cast<double>(rows.size()) / static_cast<double>(variants.size()));
    };
    rows.push_back(embedded(field, v, caches.get(v, stop_or_go), options, stop_or_go));
  }
  return rows;
}

void mark_front(std::vector<EmbedRow>& rows, const EmbedMargin& margin) {
  std::vector<std::vector<double>> figures;
  figures.reserve(rows.size());
  for (const EmbedRow& row : rows) figures.push_back(figures_of(row));
  const auto front = pareto_front(figures, margins_of(margin));
  for (std::size_t i = 0; i < rows.size(); ++i) rows[i].front = front[i];
}

std::string judgement(const std::vector<EmbedRow>& rows, const EmbedMargin& margin) {
  if (rows.empty()) throw ValueError("[judgement] rows must not be empty");
  const EmbedRow& usual = rows.front();
  const auto line = [](const char* format, auto... values) {
    char text[200];
    std::snprintf(text, sizeof text, format, values...);
    return std::string(text);
  };
  std::string text = line("The default reads %.1f%% of the bits at %.2f dB after %.0f s. ",
                          100 * usual.accuracy, usual.psnr_foreground, usual.seconds);
  std::string better;
  for (const EmbedRow& row : rows) {
    const std::vector<std::vector<double>> pair{figures_of(usual), figures_of(row)};
    if (pareto_front(pair, margins_of(margin))[0]) continue;
    better += (better.empty() ? "" : "; ") + row.variant.choice + ": " + row.variant.setting +
              line(" (%+.1f points, %+.2f dB, %.2f of the time)", 100 * (row.accuracy - usual.accuracy),
                   row.psnr_foreground - usual.psnr_foreground, row.seconds / usual.seconds);
  }
  return text + (better.empty() ? "It is on the front: nothing beats it." : "What beats it: " + better + ".");
}

}  // namespace fieldmark::bench
