#include <fieldmark/core/error.h>
#include <fieldmark/core/number_text.h>
#include <fieldmark/imaging/image.h>
#include <fieldmark/nerf/camera_set.h>
#include <fieldmark/nerf/renderer.h>
#include <fieldmark/tools/bench/tracing_bench.h>
#include <fieldmark/watermark/keys/keyed_hash.h>
#include <fieldmark/watermark/reading/informed_reader.h>
#include <fieldmark/watermark/tracing/copies.h>
#include <fieldmark/watermark/tracing/trace.h>

#include <algorithm>
#include <array>
#include <memory>
#include <set>

namespace fieldmark::bench {
namespace {

using Signs = std::vector<std::int8_t>;

// The list of one repetition: names 1 to N, of which some are guilty.
struct Recipients {
  watermark::Key key{};
  watermark::Message message{};
  std::vector<std::string> names{};
  std::set<std::string> guilty{};
  std::vector<Signs> signs{};  // of the cells of each guilty copy
};

void check(const TracingBenchOptions& o, const watermark::Owner& owner) {
  const auto at_least = [](const char* name, Index value, Index least) {
    if (value < least)
      throw ValueError("[run_tracing_bench] " + std::string(name) + " must be at least " +
                       std::to_string(least) + ", got " + std::to_string(value));
  };
  if (!owner.mark().has_cells())
    throw ValueError("[run_tracing_bench] owner must have a mark with cells, got preset " +
                     owner.mark().preset());
  at_least("repetitions", o.repetitions, 1);
  at_least("views", o.views, 1);
  for (const TracingCase& c : o.cases) {
    at_least("guilty", c.guilty, 1);
    at_least("recipients", o.recipients, c.guilty + 1);
  }
  if (!(o.fpr > 0 && o.fpr <= 1))
    throw ValueError("[run_tracing_bench] fpr must be in (0, 1], got " + number_text(o.fpr));
}

Recipients draw_recipients(const watermark::Owner& owner, const TracingBenchOptions& o, Index guilty,
                           std::uint64_t trial) {
  const CounterRng messages(o.seed, 61), names(o.seed, 62);
  const std::string purpose = "bench tracing " + std::to_string(o.seed) + " " + std::to_string(trial);
  Recipients r{.key = watermark::derive_key(owner.own_key(), purpose, 0),
               .message = watermark::random_message(owner.options().bits, messages, trial)};
  for (Index i = 0; i < o.recipients; ++i) r.names.push_back(std::to_string(i + 1));
  for (std::uint64_t draw = 0; std::ssize(r.guilty) < guilty; ++draw) {
    const std::string& name = r.names[at(names.below(o.recipients, trial, draw))];
    if (!r.guilty.insert(name).second) continue;
    r.signs.push_back(watermark::cell_signs(owner.code(watermark::copy_key(r.key, name)), r.message));
  }
  return r;
}

nerf::Renderer::Recolour averaged(std::vector<nerf::Renderer::Recolour> copies) {
  return [copies = std::move(copies)](const float* x, const float* d, Index n, float* rgb) {
    const std::vector<float> unmarked(rgb, rgb + 3 * n);
    std::vector<float> sum(unmarked.size(), 0.f), colours;
    for (const auto& copy : copies) {
      colours = unmarked;
      copy(x, d, n, colours.data());
      for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += colours[i];
    }
    for (std::size_t i = 0; i < sum.size(); ++i) rgb[i] = sum[i] / static_cast<float>(copies.size());
  };
}

Signs pasted(const std::vector<Signs>& copies, const CounterRng& rng, std::uint64_t trial) {
  Signs signs = copies.front();
  for (std::size_t cell = 0; cell < signs.size(); ++cell)
    signs[cell] = copies[at(rng.below(std::ssize(copies), trial, cell))][cell];
  return signs;
}

nerf::Renderer::Recolour mixed(const watermark::Owner& owner, CopyMix mix, const std::vector<Signs>& copies,
                               const CounterRng& rng, std::uint64_t trial) {
  if (mix == CopyMix::pasted) return owner.marking(pasted(copies, rng, trial));
  std::vector<nerf::Renderer::Recolour> marks;
  for (const Signs& signs : copies) marks.push_back(owner.marking(signs));
  return averaged(std::move(marks));
}

// Adds the evidence of the views of one field.
class Suspect {
 public:
  Suspect(const watermark::Owner& owner, const TracingBenchOptions& options)
      : owner_(owner), options_(options), renderer_(owner.field), blind_(owner) {
    if (options.informed) informed_ = std::make_unique<watermark::InformedReader>(owner);
  }
  std::vector<double> evidence(nerf::Renderer::Recolour field, std::uint64_t trial,
                               const std::function<void()>& before_view) {
    renderer_.set_recolour(std::move(field));
    std::vector<double> sum(at(owner_.cells.count()), 0.0);
    const std::array<std::uint32_t, 4> seed = CounterRng(options_.seed, 64).bits(trial);
    for (const nerf::Camera& camera :
         nerf::make_cameras(owner_.field.cameras, nerf::CameraSet::novel, options_.views, 0, seed[0])) {
      before_view();
      const Tensor<float> image = quantize8(renderer_.render(camera).rgb);
      const auto read = informed_ ? informed_->read(image).evidence() : blind_.evidence(image);
      for (std::size_t c = 0; c < sum.size(); ++c) sum[c] += read[c];
    }
    return sum;
  }

 private:
  const watermark::Owner& owner_;
  const TracingBenchOptions& options_;
  nerf::Renderer renderer_;
  watermark::BlindReader blind_;
  std::unique_ptr<watermark::InformedReader> informed_;
};

void add_traced(const std::vector<watermark::TracedCopy>& traced, const std::set<std::string>& guilty,
                double fpr, TracingRow& row) {
  Index found = 0;
  for (const watermark::TracedCopy& copy : traced) {
    const bool named = copy.p_corrected <= fpr;
    if (guilty.contains(copy.name)) {
      found += named;
      row.worst_guilty = std::max(row.worst_guilty, copy.p_corrected);
    } else {
      row.innocents_named += named;
      row.least_innocent = std::min(row.least_innocent, copy.p_corrected);
    }
  }
  ++row.repetitions;
  row.found += found;
  row.all_found += found == std::ssize(guilty);
}

}  // namespace

std::string TracingCase::name() const {
  if (guilty == 1) return "one copy";
  return (mix == CopyMix::average ? "average of " : "pasted from ") + std::to_string(guilty);
}

std::vector<TracingRow> run_tracing_bench(const watermark::Owner& owner, const TracingBenchOptions& options,
                                          const std::function<void(const std::string&, double)>& progress) {
  check(options, owner);
  const CounterRng pastes(options.seed, 63);
  Suspect suspect(owner, options);
  std::vector<TracingRow> rows;
  std::uint64_t trial = 0;
  const double trials = static_cast<double>(std::ssize(options.cases) * options.repetitions);
  for (const TracingCase& copies : options.cases) {
    TracingRow row{.copies = copies};
    for (Index i = 0; i < options.repetitions; ++i, ++trial) {
      const auto tell = [&] {
        if (progress) progress(copies.name(), static_cast<double>(trial) / trials);
      };
      const Recipients r = draw_recipients(owner, options, copies.guilty, trial);
      const auto evidence = suspect.evidence(mixed(owner, copies.mix, r.signs, pastes, trial), trial, tell);
      const auto traced = watermark::trace_copies(evidence, owner.cells.weights(), r.key, r.message, r.names,
                                                  options.fpr, [&](Index, Index) {
                                                    tell();
                                                    return true;
                                                  });
      add_traced(traced, r.guilty, options.fpr, row);
    }
    rows.push_back(row);
  }
  return rows;
}

}  // namespace fieldmark::bench
