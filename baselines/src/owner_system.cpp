#include "owner_system.h"
#include <fieldmark/baselines/paper_plan.h>
#include <fieldmark/watermark/embedding/embed_views.h>
#include <fieldmark/watermark/reading/blind_reader.h>

#include <algorithm>
#include <array>
#include <bit>
#include <memory>

namespace fieldmark::baselines {
namespace {

constexpr double kStrength = 34;                                  // dB on the object
constexpr Index kOurPatch = 128, kPaperPatch = 150, kLeast = 32;  // pixels

watermark::Owner new_owner(const nerf::RadianceField& field, const CellName& name, const OwnerSystem& system,
                           std::span<const watermark::CachedView> views) {
  const auto& o = system.owner;
  auto cells = o.preset == watermark::Preset::fast
                   ? watermark::CellGrid(o.cells, watermark::visible_area(views, o.cells))
                   : watermark::message_slots(o.bits);
  return {field, o, measuring_key(name.seed), std::move(cells)};
}

}  // namespace

bool has_owner(std::string_view system) { return paper_system(system).through_owner; }

OwnerSystem owner_system(const CellName& name, Index image) {
  const std::string& system = name.system;
  if (!has_owner(system))
    throw ValueError("[owner_system] name.system must be one that is trained through an owner, got " +
                     system);
  using watermark::Preset;
  const bool ours = system.starts_with("ours"), cells = system != "ours_without_cells";
  const Preset preset = system == "copyrnerf_code" ? Preset::code
                        : ours && cells            ? Preset::fast
                                                   : Preset::paper;
  OwnerSystem s{.owner = watermark::owner_options(preset),
                .embed = watermark::embed_options(ours ? Preset::fast : preset)};
  s.owner.bits = name.bits;
  s.owner.mark_psnr = kStrength;
  s.owner.seed = name.seed;
  s.owner.reader_size = std::clamp(image, kLeast, ours ? kOurPatch : kPaperPatch);
  s.embed.seed = name.seed;
  if (system == "ours_without_dense") s.embed.sign_weight = s.embed.index_weight = 0;
  s.owner.budget = !cells;
  s.owner.keyed_signs = system != "ours_without_signs";
  if (system == "nerf_message") s.place = MessagePlace::inputs;
  if (system == "geometry") s.place = MessagePlace::density;
  s.owner.colours = !s.place;
  if (system == "without_mff") s.owner.fusion.bare_message = true;
  if (system == "without_cff") s.owner.fusion.bare_colour = true;
  if (system == "without_drr")
    s.embed.distortions = {
        .noise = 0, .rotation = 0, .zoom_out = 1, .zoom_in = 1, .blur = 0, .sample_shift = 0};
  if (system == "drs") s.test_shift = s.embed.distortions.sample_shift;
  return s;
}

CellName trained_as(const CellName& name) {
  CellName trained = name;
  if (name.system == "drs") trained.system = "copyrnerf_paper";
  return trained;
}

watermark::Key measuring_key(std::uint64_t seed) {
  const CounterRng rng(seed, 61);
  std::array<std::uint8_t, 32> bytes{};
  for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<std::uint8_t>(rng.bits(i)[0]);
  return watermark::key_from_bytes(bytes);
}

TrainedOwner train_owner(const nerf::RadianceField& field, const CellName& name, const OwnerSystem& system,
                         const OwnerTraining& training) {
  const auto tell = [&](const std::string& what, Index done, Index total) {
    return !training.progress ||
           training.progress(what, static_cast<double>(done) / static_cast<double>(total), "");
  };
  const auto views = watermark::cache_novel_views(field, system.owner.patch(), training.views, name.seed,
                                                  [&](Index done, Index total) {
                                                    if (!tell("views", done, total))
                                                      throw Stopped("views: stopped, nothing to save");
                                                    return true;
                                                  });
  TrainedOwner trained{
      .owner = new_owner(field, name, system, views), .field = {}, .test_shift = system.test_shift};
  auto options = system.embed;
  if (system.place) {
    const auto& o = system.owner;
    trained.field.emplace(
        trained.owner.params, field,
        MessageFieldOptions{.place = *system.place, .bits = o.bits, .width = o.width, .seed = o.seed});
    options.image = [&](Tape<float>& tape, const Params<float>& params, const watermark::CachedView& view,
                        Var<float> message) {
      return trained.field->image(tape, params, field, view.camera, message);
    };
  }
  options.views = training.views;
  options.schedule.steps = 0;
  options.schedule.seconds = training.seconds;
  watermark::Embedder embedder(trained.owner, views, options);
  trained.seconds = timed_run({.what = trained_as(name).stem(),
                               .seconds = training.seconds,
                               .done = [&] { return embedder.done(); },
                               .step = [&](double seconds) { embedder.step(seconds); },
                               .steps = [&] { return embedder.steps(); },
                               .figure = [&] { return embedder.figures().bits; },
                               .save = [&](const auto& path) { embedder.save(path); },
                               .restore = [&](const auto& path) { embedder.restore(path); },
                               .checkpoint = training.checkpoint},
                              training.progress);
  embedder.calibrate();
  trained.steps = embedder.steps();
  return trained;
}

watermark::Owner with_noisy_weights(const watermark::Owner& owner, double deviation, std::uint64_t seed) {
  if (!(deviation >= 0))
    throw ValueError("[with_noisy_weights] deviation must not be negative, got " + std::to_string(deviation));
  watermark::Owner noisy = owner;
  const auto add = [&](ParamStore<float>& store, std::uint64_t stream, std::string_view prefix) {
    const CounterRng rng(seed, stream);
    for (const auto& e : store.entries()) {
      if (!e.name.starts_with(prefix)) continue;
      for (Index i = e.offset; i < e.offset + e.shape.size(); ++i)
        store.values()[static_cast<std::size_t>(i)] +=
            static_cast<float>(deviation) * rng.normal2(static_cast<std::uint64_t>(i))[0];
    }
  };
  add(noisy.field.params, 62, "");
  add(noisy.params, 63, "mark/");
  return noisy;
}

namespace {

// Positions moved as EmbedDistortions::sample_shift moves them, each by numbers that depend on where it is.
std::vector<float> moved(const float* x, Index n, double shift, const CounterRng& rng) {
  std::vector<float> y(x, x + 3 * n);
  for (std::size_t k = 0; k < y.size(); k += 3) {
    const auto z = rng.uniform4(
        (std::uint64_t{std::bit_cast<std::uint32_t>(y[k])} << 32) | std::bit_cast<std::uint32_t>(y[k + 1]),
        std::bit_cast<std::uint32_t>(y[k + 2]));
    for (std::size_t a = 0; a < 3; ++a) y[k + a] += static_cast<float>(shift) * 3.4641f * (z[a] - 0.5f);
  }
  return y;
}

}  // namespace

MarkedScene marked_scene(const TrainedOwner& marked, std::uint64_t seed, const nerf::RenderOptions& options) {
  const watermark::Owner& owner = marked.owner;
  const auto renderer = std::make_shared<nerf::Renderer>(owner.field, options);
  const auto code = std::make_shared<watermark::CellCode>(owner.code());
  const auto reader = std::make_shared<watermark::BlindReader>(owner);
  const Index bits = owner.options().bits;
  return {.bits = bits,
          .message = [=](Index view) { return message_of_view(bits, seed, view); },
          .render =
              [=, &marked](const nerf::Camera& camera, const watermark::Message& message) {
                const auto signs = watermark::cell_signs(*code, message);
                if (marked.field)
                  return marked.field->render(marked.owner.params, marked.owner.field, camera, signs,
                                              options);
                auto recolour = marked.owner.marking(signs);
                if (marked.test_shift > 0)
                  recolour = [=, &marked](const float* x, const float* d, Index n, float* rgb) {
                    recolour(moved(x, n, marked.test_shift, CounterRng(seed, 64)).data(), d, n, rgb);
                  };
                renderer->set_recolour(recolour);
                return renderer->render(camera).rgb;
              },
          .accuracy =
              [=](const Tensor<float>& image, const watermark::Message& sent) {
                return match_bits(read_bits(reader->evidence(image), *code, bits), sent).accuracy();
              }};
}

}  // namespace fieldmark::baselines
