#include <fieldmark/distort/affine_warp.h>
#include <fieldmark/distort/blur.h>
#include <fieldmark/distort/noise.h>
#include <fieldmark/distort/quantize8.h>
#include <fieldmark/distort/similarity.h>
#include <fieldmark/engine/ops/arithmetic.h>
#include <fieldmark/watermark/embedding/embedder.h>
#include <fieldmark/watermark/keys/keyed_hash.h>

#include <algorithm>
#include <cmath>

namespace fieldmark::watermark {
namespace {

constexpr AdamOptions kAdam{.lr = 1, .beta2 = kEmbedBeta2, .eps = 1e-8, .zero_grads = true};
constexpr std::uint64_t kOfBatch = 8 * 64;  // index of a whole batch's draws, after those of 64 images

double blend(double from, double to, double fraction) { return from + (to - from) * fraction; }

}  // namespace

Embedder::Embedder(Owner& owner, std::span<const CachedView> views, const EmbedOptions& options)
    : TrainingRun(options.schedule),
      owner_(owner),
      views_(views),
      options_(options),
      choice_rng_(options.seed, 11),
      message_rng_(options.seed, 12),
      noise_rng_(options.seed, 13),
      shift_rng_(options.seed, 14),
      loop_(static_cast<int>(std::clamp<Index>(options.batch, 1, 64)), owner.params.size()) {
  if (options.batch < 1 || options.batch > 64)
    throw ValueError("[embedder] batch must be 1 to 64, got " + std::to_string(options.batch));
  if (views.empty()) throw ValueError("[embedder] views must not be empty");
  if (!(options.extractor_lr > 0))
    throw ValueError("[embedder] extractor_lr must be positive, got " + std::to_string(options.extractor_lr));
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

// Networks that never see the owner's code hold no trace of its key.
CellCode Embedder::fresh_code(std::uint64_t place) const {
  return owner_.code(derive_key(key_of_seed(options_.seed), "fieldmark training code", place));
}

TrainingImage Embedder::draw(Index image, Tape<float>& tape) const {
  const auto step = static_cast<std::uint64_t>(steps()), i = static_cast<std::uint64_t>(image);
  const EmbedDistortions& d = options_.distortions;
  const auto u = [&](std::uint64_t k) { return choice_rng_.uniform4(step, 8 * i + k); };
  const auto a = u(0), b = u(1), c = u(2);
  TrainingImage p{.step = steps()};
  p.view = std::min(static_cast<Index>(a[0] * static_cast<float>(views_.size())),
                    static_cast<Index>(views_.size()) - 1);
  const std::uint64_t place = step * static_cast<std::uint64_t>(options_.batch) + i;
  p.message = random_message(owner_.options().bits, message_rng_, place);
  p.code = fresh_code(place);
  p.signs = cell_signs(p.code, p.message);
  const auto often = [](float x) { return x < 2.f / 3; };
  // Unless distortions are mixed, the whole batch takes one of none, rotation, zoom, blur and noise.
  const int only = d.mixed ? 0 : static_cast<int>(5 * choice_rng_.uniform4(step, kOfBatch)[0]);
  const auto through = [&](int kind, bool drawn) { return d.mixed ? drawn : kind == only; };
  const bool turned = through(1, often(a[1])), zoomed = through(2, often(a[3]));
  const double angle =
      turned ? blend(-d.rotation, d.rotation, static_cast<double>(a[2])) * 3.14159265358979 / 180 : 0;
  const double zoom = zoomed ? blend(d.zoom_out, d.zoom_in, static_cast<double>(b[0])) : 1;
  // Draws a window at a random place inside the image; a small shift where the whole image is visible.
  const PatchSize patch = owner_.options().patch();
  const auto size = static_cast<double>(patch.height),
             height = static_cast<double>(views_[at(p.view)].height);
  const double room = 0.5 * std::max(zoom - 1, 0.04);
  const double sx = blend(-room, room, static_cast<double>(b[1])) * static_cast<double>(patch.width),
               sy = blend(-room, room, static_cast<double>(b[2])) * size;
  p.warped = turned || zoomed || height != size;
  p.warp = distort::similarity_matrix(static_cast<float>(angle), static_cast<float>(zoom * size / height),
                                      static_cast<float>(sx), static_cast<float>(sy));
  const float blur = through(3, b[3] < 1.f / 3) ? static_cast<float>(d.blur) * c[0] : 0.f,
              noise = through(4, often(c[1])) ? static_cast<float>(d.noise) * c[2] : 0.f;
  p.positions = shifted_positions(tape, p.view, place);
  p.distort = [this, place, blur, noise, warped = p.warped, warp = p.warp](Var<float> x) {
    return distorted(x, place, warped, warp, blur, noise);
  };
  return p;
}

// Returns the samples of a view, each moved by a random shift.
float* Embedder::shifted_positions(Tape<float>& tape, Index view, std::uint64_t place) const {
  const CachedView& v = views_[at(view)];
  const Index samples = static_cast<Index>(v.weight.size());
  float* x = tape.scratch(3 * samples);
  const auto beta = static_cast<float>(options_.distortions.sample_shift);
  for (Index k = 0; k < samples; ++k) {
    const auto z = shift_rng_.uniform4(place, static_cast<std::uint64_t>(k));
    // Draws a uniform number of variance 1 per axis: the distribution of so small a shift does not matter.
    for (Index a = 0; a < 3; ++a)
      x[3 * k + a] = v.position[at(3 * k + a)] + beta * 3.4641f * (z[at(a)] - 0.5f);
  }
  return x;
}

Var<float> Embedder::distorted(Var<float> image, std::uint64_t place, bool warped,
                               const std::array<float, 6>& warp, float blur, float noise) const {
  Tape<float>& tape = image.tape();
  const float level = nerf::background_value(owner_.field.background);
  const float background[3] = {level, level, level};
  const auto number = [&](float value) {
    float* to = tape.scratch(1);
    *to = value;
    return tape.constant(to, {1});
  };
  if (warped) {
    float* matrix = tape.scratch(6);
    std::copy(warp.begin(), warp.end(), matrix);
    const PatchSize size = owner_.options().patch();
    image = distort::affine_warp(image, tape.constant(matrix, {6}),
                                 {.height = size.height, .width = size.width, .background = background});
  }
  if (blur > 0) image = distort::blur(image, number(blur));
  if (noise > 0) {
    const Index n = image.shape().size();
    float* field = tape.scratch(n + 3);
    for (Index i = 0; i < n; i += 4) {
      const auto z = noise_rng_.normal4(place, static_cast<std::uint64_t>(i));
      std::copy_n(z.data(), std::min<Index>(4, n - i), field + i);
    }
    image = distort::noise(image, number(noise), std::span<const float>(field, at(n)));
  }
  return distort::quantize8(image);
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
  file.add("key", {32}, std::span<const std::uint8_t>(owner_.key.bytes));
}

void Embedder::restore_more(const SafetensorsFile& file) {
  if (file.u8("key") != std::vector<std::uint8_t>(owner_.key.bytes.begin(), owner_.key.bytes.end()))
    throw IoError(file.path + ": expected a checkpoint under this key, found one under another");
}

Key Embedder::checkpoint_key(const std::filesystem::path& path) {
  const SafetensorsFile file = SafetensorsFile::read(path);
  if (!file.has("key"))
    throw IoError(path.string() + ": expected a checkpoint of embed, found no tensor 'key'");
  const std::vector<std::uint8_t> bytes = file.u8("key");
  if (bytes.size() != Key{}.bytes.size())
    throw IoError(path.string() + ": tensor 'key': expected " + std::to_string(Key{}.bytes.size()) +
                  " bytes, found " + std::to_string(bytes.size()));
  return key_from_bytes(bytes);
}

}  // namespace fieldmark::watermark
