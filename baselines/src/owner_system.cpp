#include "owner_system.h"

#include <fieldmark/baselines/paper_plan.h>
#include <fieldmark/core/number_text.h>
#include <fieldmark/engine/ops/arithmetic.h>
#include <fieldmark/watermark/embedding/embed_views.h>
#include <fieldmark/watermark/mark/power_budget.h>
#include <fieldmark/watermark/reading/blind_reader.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstdlib>
#include <memory>

#include "message_field.h"

namespace fieldmark::baselines {
namespace {

constexpr double kMarkPsnr = 34;               // dB
constexpr Index kCells = 16;                   // per axis
constexpr Index kOurPatch = 128, kLeast = 32;  // pixels

using watermark::Owner;
using Signs = std::vector<std::int8_t>;

// Cells that show the bit unchanged, whatever the key.
struct UnkeyedMark : watermark::CellMark {
  using CellMark::CellMark;
  watermark::CellCode code(const watermark::CellGrid& cells, const watermark::Key& key,
                           Index bits) const override {
    auto code = CellMark::code(cells, key, bits);
    for (std::int8_t& sign : code.sign) sign = static_cast<std::int8_t>(std::abs(sign));
    return code;
  }
};

// c + g (c_m - c) instead of c_m, trained with a power budget instead of the content loss.
class BudgetMark : public watermark::FusionMark {
 public:
  using FusionMark::FusionMark;
  bool has_gain() const override { return true; }
  nerf::Renderer::Recolour recolour(const Owner& owner, Signs signs) const override {
    return [&owner, whole = FusionMark::recolour(owner, std::move(signs))](const float* x, const float* d,
                                                                           Index n, float* rgb) {
      std::vector<float> marked(rgb, rgb + 3 * n);
      whole(x, d, n, marked.data());
      for (Index i = 0; i < 3 * n; ++i)
        rgb[i] = std::clamp(
            rgb[i] + static_cast<float>(owner.gain) * (marked[static_cast<std::size_t>(i)] - rgb[i]), 0.f,
            1.f);
    };
  }

 protected:
  Painter painter(const Owner& owner, std::span<const watermark::CachedView> views) const override {
    std::vector<std::vector<float>> foreground;
    for (const auto& v : views) foreground.push_back(watermark::foreground_mask(v));
    return [&owner, views, whole = FusionMark::painter(owner, views), foreground = std::move(foreground)](
               Tape<float>& tape, const Params<float>& params, const watermark::TrainingImage& image,
               Var<float> message) {
      const auto view = static_cast<std::size_t>(image.view);
      const Var<float> marked = whole(tape, params, image, message),
                       base = tape.constant(views[view].base.data.data(), marked.shape());
      const double rms = watermark::residual_rms({}, owner.options().mark_psnr, image.step);
      return add(base, watermark::power_budget<float>(sub(marked, base), foreground[view], rms));
    };
  }
};

// The densities of a MessageField depend on the message, so it renders its own images.
class MessageMark : public watermark::PooledMark {
 public:
  MessageMark(MessageField field, extractor::PooledExtractor<float> reader)
      : PooledMark(std::move(reader), watermark::paper_options().training, true), field_(std::move(field)) {}
  std::string preset() const override { return "message_field"; }
  std::string configuration() const override {
    const MessageFieldOptions& o = field_.options();
    return std::string(R"({"bits":)") + std::to_string(o.bits) + R"(,"place":")" +
           (o.place == MessagePlace::inputs ? "inputs" : "density") + R"(","width":)" +
           std::to_string(o.width) + "}";
  }
  nerf::Renderer::Recolour recolour(const Owner&, Signs) const override {
    throw ValueError("[owner_system] a message field marks more than colours");
  }
  const MessageField& field() const { return field_; }

 protected:
  Painter painter(const Owner& owner, std::span<const watermark::CachedView> views) const override {
    return [this, &owner, views](Tape<float>& tape, const Params<float>& params,
                                 const watermark::TrainingImage& image, Var<float> message) {
      return field_.image(tape, params, owner.field, views[static_cast<std::size_t>(image.view)].camera,
                          message);
    };
  }

 private:
  MessageField field_;
};

// A mark of the paper's networks from which `change` removes a part.
template <class Mark, class Change>
watermark::MarkMaker paper_mark(const watermark::FusionMarkOptions& options, Change change) {
  return [=](const watermark::MarkSite& site) {
    auto network = watermark::network_options(options, site.bits);
    change(network);
    watermark::GlobalMark<float> mark(site.params, "mark", network, site.seed + 100);
    return std::make_shared<Mark>(std::move(mark), watermark::pooled_reader(site, options.channels), options);
  };
}

}  // namespace

bool has_owner(std::string_view system) { return paper_system(system).through_owner; }

OwnerSystem owner_system(const CellName& name, Index image) {
  const std::string& system = name.system;
  if (!has_owner(system))
    throw ValueError("[owner_system] name.system must be one that is trained through an owner, got " +
                     system);
  const bool ours = system.starts_with("ours");
  OwnerSystem s{.recipe = watermark::embed_recipe(system == "copyrnerf_code" ? "code"
                                                  : ours                     ? "fast"
                                                                             : "paper")};
  auto& r = s.recipe;
  r.owner.bits = name.bits;
  r.owner.mark_psnr = kMarkPsnr;
  r.owner.seed = r.embed.seed = name.seed;
  r.owner.reader_size = std::clamp(image, kLeast, ours ? kOurPatch : r.owner.reader_size);
  r.cells = kCells;
  if (system == "ours_without_dense") r.cell().training.sign_weight = r.cell().training.index_weight = 0;
  if (system == "ours_without_cells") {  // no content loss
    const double rate = r.cell().training.matrix_rate;
    r.mark = watermark::FusionMarkOptions{.training = {.content_weight = 0, .matrix_rate = rate}};
  }
  for (const auto& [of, ablation] : {std::pair{"ours_without_signs", Ablation::unkeyed_signs},
                                     {"ours_without_cells", Ablation::power_budget},
                                     {"without_mff", Ablation::no_message_features},
                                     {"without_cff", Ablation::no_colour_features},
                                     {"nerf_message", Ablation::message_in_inputs},
                                     {"geometry", Ablation::message_in_density}})
    if (system == of) s.ablation = ablation;
  if (system == "cold_start") std::get<watermark::FusionMarkOptions>(r.mark).training.warm_steps = 0;
  if (system == "without_drr")
    r.embed.distortions = {
        .noise = 0, .rotation = 0, .zoom_out = 1, .zoom_in = 1, .blur = 0, .sample_shift = 0};
  if (system == "drs") s.test_shift = r.embed.distortions.sample_shift;
  return s;
}

watermark::MarkMaker mark_maker(const OwnerSystem& system) {
  const watermark::EmbedRecipe& recipe = system.recipe;
  if (system.ablation == Ablation::none) return recipe.maker();
  if (system.ablation == Ablation::unkeyed_signs)
    return [options = std::get<watermark::CellMarkOptions>(recipe.mark)](const watermark::MarkSite& site) {
      return std::make_shared<UnkeyedMark>(site, options);
    };
  const auto options = std::get<watermark::FusionMarkOptions>(recipe.mark);
  using watermark::FusionMark, watermark::GlobalMarkOptions;
  if (system.ablation == Ablation::no_message_features)
    return paper_mark<FusionMark>(options, [](GlobalMarkOptions& o) { o.message_features = 0; });
  if (system.ablation == Ablation::no_colour_features)
    return paper_mark<FusionMark>(options, [](GlobalMarkOptions& o) { o.colour_features = 0; });
  if (system.ablation == Ablation::power_budget)
    return paper_mark<BudgetMark>(options, [](GlobalMarkOptions&) {});
  const auto place =
      system.ablation == Ablation::message_in_inputs ? MessagePlace::inputs : MessagePlace::density;
  return [=](const watermark::MarkSite& site) {
    MessageField field(site.params, site.field,
                       {.place = place, .bits = site.bits, .width = options.width, .seed = site.seed});
    return std::make_shared<MessageMark>(std::move(field), watermark::pooled_reader(site, options.channels));
  };
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
  const auto views = watermark::cache_novel_views(field, system.recipe.owner.patch(), training.views,
                                                  name.seed, [&](Index done, Index total) {
                                                    if (!tell("views", done, total))
                                                      throw Stopped("views: stopped, nothing to save");
                                                    return true;
                                                  });
  const auto& recipe = system.recipe;
  TrainedOwner trained{
      .owner = {field, recipe.owner, measuring_key(name.seed), recipe.grid(field, views), mark_maker(system)},
      .test_shift = system.test_shift};
  auto options = recipe.embed;
  options.schedule.steps = training.steps;
  options.schedule.seconds = training.seconds;
  watermark::Embedder embedder(trained.owner, views, options);
  trained.seconds =
      timed_run(embedder, trained_as(name).stem(), training.seconds, training.checkpoint, training.progress);
  trained.curve = embedder.curve();
  embedder.calibrate();
  trained.steps = embedder.steps();
  return trained;
}

watermark::Owner with_noisy_weights(const watermark::Owner& owner, double deviation, std::uint64_t seed) {
  if (!(deviation >= 0))
    throw ValueError("[with_noisy_weights] deviation must not be negative, got " + number_text(deviation));
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

// Shifts positions as EmbedDistortions::sample_shift does, by random numbers that depend on the position.
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
                if (const auto* mark = dynamic_cast<const MessageMark*>(&marked.owner.mark()))
                  return mark->field().render(marked.owner.params, marked.owner.field, camera, signs,
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
