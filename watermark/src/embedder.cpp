#include <fieldmark/distort/affine_warp.h>
#include <fieldmark/distort/blur.h>
#include <fieldmark/distort/noise.h>
#include <fieldmark/distort/quantize8.h>
#include <fieldmark/distort/resize_area.h>
#include <fieldmark/distort/similarity.h>
#include <fieldmark/engine/metrics.h>
#include <fieldmark/engine/ops/arithmetic.h>
#include <fieldmark/engine/ops/loss.h>
#include <fieldmark/engine/ops/pool.h>
#include <fieldmark/engine/ops/softmax.h>
#include <fieldmark/extractor/evidence_pool.h>
#include <fieldmark/watermark/embedder.h>
#include <fieldmark/watermark/power_budget.h>
#include <fieldmark/watermark/weighted_segments.h>

#include <algorithm>
#include <cmath>

namespace fieldmark::watermark {
namespace {

constexpr Index kCoarse = 8;  // pixels a side that eyes average at a glance
constexpr double kReadable = 0.7,
                 kSafe = 0.8;  // shares of right signs between which the mark learns to hide
constexpr float kBitScale = 6;  // pooled evidence lies in [-1, 1]: this makes it a logit

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

// How flat the base picture is around each pixel of the object: exp(-(s / 0.03)^2), s the standard deviation
// of the green channel in 5 x 5 pixels; the same for the three channels.
std::vector<float> flatness(const CachedView& v, const std::vector<float>& object) {
  std::vector<float> flat(3 * object.size(), 0.f);
  for (Index y = 0; y < v.height; ++y)
    for (Index x = 0; x < v.width; ++x) {
      const Index p = y * v.width + x;
      if (object[at(p)] == 0) continue;
      float sum = 0, squares = 0, n = 0;
      for (Index j = std::max<Index>(y - 2, 0); j <= std::min(y + 2, v.height - 1); ++j)
        for (Index i = std::max<Index>(x - 2, 0); i <= std::min(x + 2, v.width - 1); ++i) {
          const float g = v.base[3 * (j * v.width + i) + 1];
          sum += g;
          squares += g * g;
          n += 1;
        }
      const float variance = std::max(squares / n - (sum / n) * (sum / n), 0.f);
      std::fill_n(&flat[at(3 * p)], 3, std::exp(-variance / (0.03f * 0.03f)));
    }
  return flat;
}

double blend(double from, double to, double fraction) { return from + (to - from) * fraction; }

}  // namespace

// Everything random about one training picture.
struct Embedder::Picture {
  Index view;
  std::uint64_t step, image;
  Message message;
  std::vector<std::int8_t> signs;
  std::array<float, 6> warp;
  bool warped;
  float blur, noise;
  double target;  // rms of the residual on the object
};

Embedder::Embedder(Owner& owner, std::span<const CachedView> views, const EmbedOptions& options)
    : owner_(owner),
      views_(views),
      options_(options),
      schedule_(options.schedule),
      choice_rng_(options.seed, 11),
      message_rng_(options.seed, 12),
      noise_rng_(options.seed, 13),
      shift_rng_(options.seed, 14),
      code_(owner.code()),
      loop_(static_cast<int>(std::clamp<Index>(options.batch, 1, 64)), owner.params.size()),
      adam_(owner.params.size(), {.lr = 1, .beta2 = 0.99, .eps = 1e-8, .zero_grads = true}) {
  if (options.batch < 1 || options.batch > 64)
    throw ValueError("[embedder] batch must be 1 to 64, got " + std::to_string(options.batch));
  if (views.empty()) throw ValueError("[embedder] views must not be empty");
  const Index cells = owner.cells.count(), bits = owner.options().bits;
  code_matrix_.assign(at(cells * bits), 0.f);
  for (Index c = 0; c < cells; ++c)
    if (code_.bit[at(c)] >= 0)
      code_matrix_[at(c * bits + code_.bit[at(c)])] = static_cast<float>(code_.sign[at(c)]);
  for (const CachedView& v : views) {
    Tensor<std::int32_t> label({v.height, v.width}, static_cast<std::int32_t>(cells));
    std::vector<float> object(at(label.size()), 0.f);
    for (Index p = 0; p < label.size(); ++p) {
      if (v.opacity[p] <= 0.5f || v.sample_begin[at(p)] == v.sample_begin[at(p + 1)]) continue;
      object[at(p)] = 1;
      const std::int32_t cell = owner.cells.at(&v.position[at(3 * Index{v.sample_begin[at(p)]})]);
      if (cell >= 0) label[p] = cell;
    }
    labels_.push_back(std::move(label));
    flat_.push_back(flatness(v, object));
    object_.push_back(std::move(object));
  }
}

Embedder::Picture Embedder::draw(Index image) const {
  const auto step = static_cast<std::uint64_t>(steps_), i = static_cast<std::uint64_t>(image);
  const EmbedDistortions& d = options_.distortions;
  const auto u = [&](std::uint64_t k) { return choice_rng_.uniform4(step, 8 * i + k); };
  const auto a = u(0), b = u(1), c = u(2);
  Picture p{};
  p.step = step;
  p.image = i;
  p.view = std::min(static_cast<Index>(a[0] * static_cast<float>(views_.size())),
                    static_cast<Index>(views_.size()) - 1);
  p.message = random_message(owner_.options().bits, message_rng_,
                             step * static_cast<std::uint64_t>(options_.batch) + i);
  p.signs = cell_signs(code_, p.message);
  const auto often = [](float x) { return x < 2.f / 3; };
  const double angle =
      often(a[1]) ? blend(-d.rotation, d.rotation, static_cast<double>(a[2])) * 3.14159265358979 / 180 : 0;
  const double zoom = often(a[3]) ? blend(d.zoom_out, d.zoom_in, static_cast<double>(b[0])) : 1;
  // A window at a random place that stays inside the picture; a small shift where the whole picture is seen.
  const auto& size = views_[at(p.view)];
  const double room = 0.5 * std::max(zoom - 1, 0.04);
  const double sx = blend(-room, room, static_cast<double>(b[1])) * static_cast<double>(size.width),
               sy = blend(-room, room, static_cast<double>(b[2])) * static_cast<double>(size.height);
  p.warped = often(a[1]) || often(a[3]);
  p.warp = distort::similarity_matrix(static_cast<float>(angle), static_cast<float>(zoom),
                                      static_cast<float>(sx), static_cast<float>(sy));
  p.blur = b[3] < 1.f / 3 ? static_cast<float>(d.blur) * c[0] : 0.f;
  p.noise = often(c[1]) ? static_cast<float>(d.noise) * c[2] : 0.f;
  const double strength = owner_.options().strength;
  const double db = strength - (strength - options_.first_strength) *
                                   std::exp(-static_cast<double>(steps_) / options_.anneal);
  p.target = std::pow(10.0, -db / 20);
  return p;
}

// What the mark adds to the picture [pixels, 3]: the residual of the cached samples, at the step's power.
Var<float> Embedder::residual(Tape<float>& tape, const Params<float>& params, const Picture& p) const {
  const CachedView& v = views_[at(p.view)];
  const Index samples = static_cast<Index>(v.weight.size());
  float* x = tape.scratch(3 * samples);
  const auto beta = static_cast<float>(options_.distortions.sample_shift);
  const std::uint64_t place = p.step * static_cast<std::uint64_t>(options_.batch) + p.image;
  for (Index k = 0; k < samples; ++k) {
    const auto z = shift_rng_.uniform4(place, static_cast<std::uint64_t>(k));
    // A uniform number of variance 1 for each axis: the shape of so small a shift does not matter.
    for (Index a = 0; a < 3; ++a)
      x[3 * k + a] = v.position[at(3 * k + a)] + beta * 3.4641f * (z[at(a)] - 0.5f);
  }
  float* weight = tape.scratch(samples);
  owner_.cells.blend(p.signs, x, samples, weight);
  for (Index k = 0; k < samples; ++k) weight[k] *= v.weight[at(k)];
  const Var<float> carrier = owner_.mark.carrier(params, tape.constant(x, {samples, 3}),
                                                 tape.constant(v.colour.data(), {samples, 3}));
  return power_budget<float>(
      weighted_segments<float>(carrier, v.sample_begin, std::span<const float>(weight, at(samples))),
      object_[at(p.view)], p.target);
}

// The shares of the residual's power that eyes would see: what is left of it after averaging, and how strong
// it is on flat areas. Both are about 1 for a mark that takes no care.
Var<float> Embedder::visibility(Var<float> residual, const Picture& p) const {
  Tape<float>& tape = residual.tape();
  const CachedView& v = views_[at(p.view)];
  const auto power = [&](Var<float> x, std::span<const float> weights) {
    float* zeros = tape.scratch(x.shape().size());
    std::fill_n(zeros, x.shape().size(), 0.f);
    return scale(mse_loss<float>(x, tape.constant(zeros, x.shape()), weights), 1 / (p.target * p.target));
  };
  const Var<float> coarse = avg_pool(tape.reshape(residual, {1, v.height, v.width, 3}), kCoarse);
  const Index places = coarse.shape().size() / 3, columns = coarse.shape()[2];
  float* on_object = tape.scratch(3 * places);
  for (Index i = 0; i < places; ++i) {
    float sum = 0;
    for (Index j = 0; j < kCoarse * kCoarse; ++j)
      sum +=
          object_[at(p.view)]
                 [at((i / columns * kCoarse + j / kCoarse) * v.width + i % columns * kCoarse + j % kCoarse)];
    std::fill_n(on_object + 3 * i, 3, sum);
  }
  const double ramp = std::clamp((figures_.sign - kReadable) / (kSafe - kReadable), 0.0, 1.0);
  return add(scale(power(coarse, {on_object, at(3 * places)}), ramp * options_.smooth_weight),
             scale(power(residual, flat_[at(p.view)]), ramp * options_.flat_weight));
}

Var<float> Embedder::distort(Tape<float>& tape, Var<float> image, const Picture& p) const {
  const float level = nerf::background_value(owner_.field.background);
  const float background[3] = {level, level, level};
  const auto number = [&](float value) {
    float* to = tape.scratch(1);
    *to = value;
    return tape.constant(to, {1});
  };
  if (p.warped) {
    float* matrix = tape.scratch(6);
    std::copy(p.warp.begin(), p.warp.end(), matrix);
    image = distort::affine_warp(image, tape.constant(matrix, {6}), {.background = background});
  }
  if (p.blur > 0) image = distort::blur(image, number(p.blur));
  if (p.noise > 0) {
    const Index n = image.shape().size();
    float* field = tape.scratch(n + 3);
    const std::uint64_t place = p.step * static_cast<std::uint64_t>(options_.batch) + p.image;
    for (Index i = 0; i < n; i += 4) {
      const auto z = noise_rng_.normal4(place, static_cast<std::uint64_t>(i));
      std::copy_n(z.data(), std::min<Index>(4, n - i), field + i);
    }
    image = distort::noise(image, number(p.noise), std::span<const float>(field, at(n)));
  }
  return distort::quantize8(image);
}

double Embedder::run_picture(Index image, Tape<float>& tape, float* grads, Figures& figures) const {
  const Picture p = draw(image);
  const Params<float> params(owner_.params, grads);
  const Var<float> added = residual(tape, params, p);
  const CachedView& view = views_[at(p.view)];
  const Var<float> marked = add(tape.constant(view.base.data.data(), {view.height * view.width, 3}), added);
  const Var<float> picture = distort(tape, tape.reshape(marked, {view.height, view.width, 3}), p);
  const Index h = picture.shape()[0], w = picture.shape()[1];
  const auto out = owner_.reader(params, tape.reshape(picture, {1, h, w, 3}));

  // Labels move with the pixels, then go to the extractor's places.
  const auto background = static_cast<std::int32_t>(owner_.cells.count());
  Tensor<std::int32_t> labels = labels_[at(p.view)];
  if (p.warped) labels = fieldmark::distort::warp_labels<float>(labels, p.warp, background);
  labels = fieldmark::distort::resize_labels(labels, out.height, out.width);
  const Index places = out.height * out.width;
  float *target = tape.scratch(places), *on_object = tape.scratch(places);
  for (Index i = 0; i < places; ++i) {
    const std::int8_t sign = labels[i] < background ? p.signs[at(labels[i])] : std::int8_t{0};
    target[i] = sign > 0 ? 1.f : 0.f;
    on_object[i] = sign != 0 ? 1.f : 0.f;
  }
  std::vector<float> bits(p.message.bits.begin(), p.message.bits.end());
  const std::span<const float> on(on_object, at(places));
  const Var<float> pooled = scale(
      extractor::pooled_bits<float>(out.sign, out.index, code_matrix_, owner_.options().bits), kBitScale);
  const Var<float> sign_loss =
      bce_with_logits<float>(out.sign, std::span<const float>(target, at(places)), on);
  const Var<float> index_loss = softmax_cross_entropy<float>(out.index, labels.data);
  const Var<float> bits_loss = bce_with_logits<float>(pooled, bits);
  const Var<float> loss =
      scale(add(add(sign_loss, visibility(added, p)),
                add(scale(index_loss, options_.index_weight), scale(bits_loss, options_.bits_weight))),
            1.0 / static_cast<double>(options_.batch));
  const double value = static_cast<double>(loss.value()[0]);
  tape.backward(loss);

  const Index classes = owner_.cells.count() + 1;
  double sign = 0, index = 0, all = 0, right = 0;
  for (Index i = 0; i < places; ++i) {
    if (on_object[i] == 0) continue;
    const float* q = out.index.value() + i * classes;
    all += 1;
    sign += (out.sign.value()[i] > 0) == (target[i] > 0);
    index += std::max_element(q, q + classes) - q == labels[i];
  }
  for (std::size_t b = 0; b < bits.size(); ++b) right += (pooled.value()[b] > 0) == (bits[b] > 0);
  figures = {all > 0 ? sign / all : 0, all > 0 ? index / all : 0, right / static_cast<double>(bits.size()),
             value};
  return value;
}

void Embedder::step(double seconds) {
  schedule_.observe(steps_, seconds);
  std::vector<Figures> figures(at(options_.batch));
  const double loss = loop_.run(
      options_.batch,
      [&](Index image, Index, Tape<float>& tape, float* grads) {
        return run_picture(image, tape, grads, figures[at(image)]);
      },
      owner_.params.grads());
  adam_.step(owner_.params.values(), owner_.params.grads(), schedule_.lr(steps_));
  const double keep = steps_ == 0 ? 0 : 0.98, each = (1 - keep) / static_cast<double>(options_.batch);
  figures_ = {keep * figures_.sign, keep * figures_.index, keep * figures_.bits,
              keep * figures_.loss + (1 - keep) * loss};
  for (const Figures& f : figures) {
    figures_.sign += each * f.sign;
    figures_.index += each * f.index;
    figures_.bits += each * f.bits;
  }
  ++steps_;
}

void Embedder::calibrate(Index views) {
  const auto cameras =
      nerf::make_cameras(owner_.field.cameras, nerf::CameraSet::near, views, 0, options_.seed + 77);
  const double target = owner_.options().strength;
  owner_.gain = std::pow(10.0, -target / 20);
  // Three rounds: the first sets the size, the others what clamping and rounding to 8 bits change.
  for (int round = 0; round < 3; ++round) {
    double sum = 0;
    Index count = 0;
    nerf::Renderer renderer(owner_.field);
    for (std::size_t i = 0; i < cameras.size(); ++i) {
      renderer.set_recolour({});
      const nerf::Rendering plain = renderer.render(cameras[i]);
      renderer.set_recolour(owner_.marking(
          cell_signs(code_, random_message(owner_.options().bits, message_rng_, ~std::uint64_t{i}))));
      const double psnr = psnr_masked(renderer.render(cameras[i]).rgb, plain.rgb, plain.opacity);
      if (!std::isfinite(psnr)) continue;
      sum += psnr;
      ++count;
    }
    if (count == 0) return;
    owner_.gain *= std::pow(10.0, (sum / static_cast<double>(count) - target) / 20);
  }
}

std::string Embedder::fingerprint() const {
  const OwnerOptions& o = owner_.options();
  return std::to_string(o.bits) + " bits, " + std::to_string(o.strength) + " dB, " +
         std::to_string(owner_.cells.count()) + " cells, seed " + std::to_string(options_.seed) + ", steps " +
         std::to_string(options_.schedule.steps) + ", batch " + std::to_string(options_.batch) + ", views " +
         std::to_string(views_.size()) + ", parameters " + std::to_string(owner_.params.size());
}

void Embedder::save(const std::filesystem::path& path) const {
  SafetensorsFile file;
  file.metadata["fieldmark"] = R"({"format":1,"kind":"checkpoint"})";
  file.metadata["of"] = fingerprint();
  const Index n = owner_.params.size();
  file.add("values", {n}, owner_.params.values());
  file.add("mean", {n}, adam_.mean());
  file.add("mean_square", {n}, adam_.mean_square());
  const std::int64_t counts[] = {steps_, schedule_.total()};
  const double figures[] = {figures_.sign, figures_.index, figures_.bits, figures_.loss};
  file.add("counts", {2}, counts);
  file.add("figures", {4}, figures);
  file.add("key", {32}, std::span<const std::uint8_t>(owner_.key.bytes));
  file.write(path);
  make_private(path);
}

void Embedder::restore(const std::filesystem::path& path) {
  const SafetensorsFile file = SafetensorsFile::read(path);
  const auto of = file.metadata.find("of");
  if (of == file.metadata.end() || of->second != fingerprint())
    throw IoError(path.string() + ": expected a checkpoint of this run (" + fingerprint() + "), found " +
                  (of == file.metadata.end() ? std::string("another kind of file") : of->second));
  if (file.u8("key") != std::vector<std::uint8_t>(owner_.key.bytes.begin(), owner_.key.bytes.end()))
    throw IoError(path.string() + ": expected a checkpoint under this key, found one under another");
  const auto copy = [&](const char* name, std::span<float> to) {
    const Tensor<float> t = file.f32(name);
    if (t.data.size() != to.size())
      throw IoError(path.string() + ": tensor '" + name + "': expected " + std::to_string(to.size()) +
                    " numbers, found " + std::to_string(t.data.size()));
    std::copy(t.data.begin(), t.data.end(), to.begin());
  };
  copy("values", owner_.params.values());
  copy("mean", adam_.mean());
  copy("mean_square", adam_.mean_square());
  const auto counts = file.i64("counts");
  const auto figures = file.f64("figures").data;
  if (counts.size() != 2 || figures.size() != 4)
    throw IoError(path.string() + ": expected 2 counts and 4 figures, found " +
                  std::to_string(counts.size()) + " and " + std::to_string(figures.size()));
  steps_ = counts[0];
  schedule_.resume(counts[1]);
  adam_.set_steps(steps_);
  figures_ = {figures[0], figures[1], figures[2], figures[3]};
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
