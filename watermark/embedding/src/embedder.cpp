#include <fieldmark/core/number_text.h>
#include <fieldmark/engine/ops/arithmetic.h>
#include <fieldmark/watermark/embedding/embedder.h>
#include <fieldmark/watermark/keys/keyed_hash.h>

#include <algorithm>
#include <cmath>

#include "cell_strength.h"
#include "distorted_views.h"

namespace fieldmark::watermark {
namespace {

constexpr AdamOptions kAdam{.lr = 1, .beta2 = kEmbedBeta2, .eps = 1e-8, .zero_grads = true};

}  // namespace

Embedder::Embedder(Owner& owner, std::span<const CachedView> views, const EmbedOptions& options)
    : TrainingRun(options.schedule),
      owner_(owner),
      views_(views),
      options_(options),
      cells_(owner.cells),
      message_rng_(options.seed, 12),
      loop_(static_cast<int>(std::clamp<Index>(options.batch, 1, 64)), owner.params.size()) {
  cells_.set_strength({});
  if (options.batch < 1 || options.batch > 64)
    throw ValueError("[embedder] batch must be 1 to 64, got " + std::to_string(options.batch));
  if (views.empty()) throw ValueError("[embedder] views must not be empty");
  if (!(options.extractor_lr > 0))
    throw ValueError("[embedder] extractor_lr must be positive, got " + number_text(options.extractor_lr));
  drawn_ = std::make_unique<DistortedViews>(owner, views, options.distortions, options.batch, options.seed);
  training_ = owner.mark().training(owner, views);
  train(owner.params, kAdam,
        adam_ranges(owner.params, {{"extractor/*", {.lr_factor = options.extractor_lr}}, {"*"}}));
  if (const MuonWeights matrices = training_->matrices(); matrices.rate > 0)
    train_matrices(matrices.names, matrices.rate * options.extractor_lr);
  if (ParamStore<float>* helpers = training_->helpers()) train(*helpers, kAdam, {}, "helpers/");
  keep("sign", figures_.sign);
  keep("index", figures_.index);
  keep("bits", figures_.bits);
  keep("image_loss", figures_.loss);
}

Embedder::~Embedder() = default;

// Networks that never see the owner's code hold no trace of its key. Dealt by area: training does not depend
// on a calibration on the way, which measures strengths.
CellCode Embedder::fresh_code(std::uint64_t place) const {
  return owner_.mark().code(cells_, derive_key(key_of_seed(options_.seed), "fieldmark training code", place),
                            owner_.options().bits);
}

TrainingImage Embedder::draw(Index image, Tape<float>& tape) const {
  TrainingImage p = drawn_->draw(steps(), image, tape);
  const std::uint64_t place = drawn_->place(steps(), image);
  p.message = random_message(owner_.options().bits, message_rng_, place);
  p.code = fresh_code(place);
  p.signs = cell_signs(p.code, p.message);
  return p;
}

double Embedder::run_image(Index image, Tape<float>& tape, float* grads, Figures& figures) const {
  const TrainingImage p = draw(image, tape);
  const Var<float> loss =
      scale(training_->loss(tape, Params<float>(owner_.params, grads), {&p, 1}, figures_, figures),
            1.0 / static_cast<double>(options_.batch));
  const double value = static_cast<double>(loss.value()[0]);
  tape.backward(loss);
  return value;
}

double Embedder::run_batch(Figures& figures) {
  Tape<float>& tape = loop_.tape(0);
  tape.reset();
  std::vector<TrainingImage> images;
  for (Index i = 0; i < options_.batch; ++i) images.push_back(draw(i, tape));
  const Var<float> loss = training_->loss(tape, Params<float>(owner_.params), images, figures_, figures);
  tape.backward(loss);
  return static_cast<double>(loss.value()[0]);
}

double Embedder::take_step(double) {
  std::vector<Figures> figures(training_->whole_batch() ? 1 : at(options_.batch));
  const double loss = training_->whole_batch()
                          ? run_batch(figures[0])
                          : loop_.run(
                                options_.batch,
                                [&](Index image, Index, Tape<float>& tape, float* grads) {
                                  return run_image(image, tape, grads, figures[at(image)]);
                                },
                                owner_.params.grads());
  update();
  if (training_->helpers()) update(1);
  training_->finish_step(owner_.params);
  const double keep = steps() == 0 ? 0 : 0.98, each = (1 - keep) / static_cast<double>(figures.size());
  figures_ = {keep * figures_.sign, keep * figures_.index, keep * figures_.bits,
              keep * figures_.loss + (1 - keep) * loss};
  for (const Figures& f : figures) {
    figures_.sign += each * f.sign;
    figures_.index += each * f.index;
    figures_.bits += each * f.bits;
  }
  return loss;
}

void Embedder::calibrate(Index views) {
  if (!owner_.mark().has_gain()) return;
  owner_.cells.set_strength({});
  const MarkPsnrMeter meter(owner_.field, {.count = views, .seed = options_.seed + 77});
  const double target = owner_.options().mark_psnr;
  owner_.gain = std::pow(10.0, -target / 20);
  nerf::Renderer renderer(owner_.field, mark_psnr_rendering());
  // Three rounds: the first sets the scale, the others correct for clamping and rounding to 8 bits. Only the
  // last round needs all views.
  for (int round = 0; round < 3; ++round) {
    const double mark_psnr = meter(
        renderer,
        [&](Index i) {
          const auto place = ~static_cast<std::uint64_t>(i);
          const auto message = random_message(owner_.options().bits, message_rng_, place);
          renderer.set_recolour(owner_.marking(cell_signs(fresh_code(place), message)));
        },
        round < 2 ? meter.guess_step() : 1);
    if (!std::isfinite(mark_psnr)) return;
    owner_.gain *= std::pow(10.0, (mark_psnr - target) / 20);
  }
  if (owner_.mark().has_cells()) owner_.cells.set_strength(cell_strength(owner_, views_, options_.seed + 78));
}

void Embedder::describe(RunFingerprint& f) const {
  f.option("run", "embed");
  f.options("field", owner_.field.configuration());
  f.options("mark", owner_.mark().configuration());
  training_->describe(f);
  f.option("bits", owner_.options().bits);
  f.option("reader_size", owner_.options().reader_size);
  f.option("reader_aspect", owner_.options().reader_aspect);
  f.option("initial_seed", owner_.options().seed);
  f.option("codes", "fresh for each image");
  f.option("seed", options_.seed);
  f.option("batch", options_.batch);
  f.option("extractor_lr", options_.extractor_lr);
  const EmbedDistortions& d = options_.distortions;
  f.option("noise", d.noise);
  f.option("rotation", d.rotation);
  f.option("zoom_out", d.zoom_out);
  f.option("zoom_in", d.zoom_in);
  f.option("blur", d.blur);
  f.option("sample_shift", d.sample_shift);
  f.option("mixed", d.mixed);
  f.option("views", std::ssize(views_));
  f.input("field", owner_.field.params.values());
  f.input("occupancy", owner_.field.grid.bits());
  f.input("cells", owner_.cells.numbers());
  for (std::size_t i = 0; i < views_.size(); ++i) f.input("view " + std::to_string(i), views_[i].position);
}

void Embedder::save_more(SafetensorsFile& file) const {
  if (owner_.key) file.add("key", {32}, std::span<const std::uint8_t>(owner_.key->bytes));
}

void Embedder::restore_more(const SafetensorsFile& file) {
  if (file.has("key") != owner_.key.has_value())
    throw IoError(file.path + ": expected a checkpoint " +
                  (owner_.key ? "with a key, found one without" : "without a key, found one with a key"));
  if (owner_.key &&
      file.u8("key") != std::vector<std::uint8_t>(owner_.key->bytes.begin(), owner_.key->bytes.end()))
    throw IoError(file.path + ": expected a checkpoint under this key, found one under another");
}

Key Embedder::checkpoint_key(const std::filesystem::path& path) {
  const SafetensorsFile file = SafetensorsFile::read(path);
  if (!file.has("key"))
    throw IoError(path.string() + ": expected a checkpoint of embed with a key, found no tensor 'key'");
  const std::vector<std::uint8_t> bytes = file.u8("key");
  if (bytes.size() != Key{}.bytes.size())
    throw IoError(path.string() + ": tensor 'key': expected " + std::to_string(Key{}.bytes.size()) +
                  " bytes, found " + std::to_string(bytes.size()));
  return key_from_bytes(bytes);
}

}  // namespace fieldmark::watermark
