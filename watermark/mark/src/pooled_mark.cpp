#include <fieldmark/engine/ops/arithmetic.h>
#include <fieldmark/engine/ops/loss.h>
#include <fieldmark/watermark/mark/fusion_mark.h>
#include <fieldmark/watermark/mark/owner.h>

#include <algorithm>
#include <cstdio>

namespace fieldmark::watermark {
namespace {

Var<float> logits(const extractor::PooledExtractor<float>& reader, const Params<float>& params,
                  Var<float> image, const Shape& size) {
  const Var<float> out = reader(params, image.tape().reshape(image, {1, size[0], size[1], 3}));
  return image.tape().reshape(out, {out.shape().size()});
}

class PooledTraining : public MarkTraining {
 public:
  PooledTraining(const extractor::PooledExtractor<float>& reader, const PooledTrainingOptions& options,
                 const Owner& owner, std::span<const CachedView> views, PooledMark::Painter painter)
      : reader_(reader), options_(options), owner_(owner), views_(views), painter_(std::move(painter)) {}

  Var<float> loss(Tape<float>& tape, const Params<float>& params, const TrainingImage& image,
                  const TrainingFigures&, TrainingFigures& figures) const override {
    const CachedView& v = views_[at(image.view)];
    const Index bits = std::ssize(image.signs);
    float *sent = tape.scratch(bits), *targets = tape.scratch(bits);
    for (Index b = 0; b < bits; ++b) {
      sent[b] = image.signs[at(b)];
      targets[b] = sent[b] > 0 ? 1.f : 0.f;
    }
    const Var<float> marked = painter_(tape, params, image, tape.constant(sent, {1, bits}));
    const Var<float> content = mse_loss<float>(marked, tape.constant(v.base.data.data(), marked.shape()));
    const Var<float> seen = image.distort(tape.reshape(marked, {v.height, v.width, 3}));
    const Var<float> read = logits(reader_, params, seen, seen.shape());
    double right = 0;
    for (Index b = 0; b < bits; ++b) right += (read.value()[b] > 0) == (sent[b] > 0);
    figures = {.bits = right / static_cast<double>(bits)};
    return add(scale(content, options_.content_weight),
               scale(bce_with_logits<float>(read, std::span<const float>(targets, at(bits))),
                     options_.message_weight));
  }
  std::string note(const TrainingFigures& f) const override {
    char note[64];
    std::snprintf(note, sizeof note, "right: bits %.1f%%  loss %.4f", 100 * f.bits, f.loss);
    return note;
  }
  void describe(RunFingerprint& f) const override {
    f.option("content_weight", options_.content_weight);
    f.option("message_weight", options_.message_weight);
    if (owner_.mark().has_gain()) f.option("mark_psnr", owner_.options().mark_psnr);
  }

 private:
  const extractor::PooledExtractor<float>& reader_;
  PooledTrainingOptions options_;
  const Owner& owner_;
  std::span<const CachedView> views_;
  PooledMark::Painter painter_;
};

}  // namespace

CellGrid message_slots(Index bits) {
  if (bits < 1) throw ValueError("[message_slots] bits must be at least 1, got " + std::to_string(bits));
  Index side = 2;
  while (side * side * side < bits) ++side;
  std::vector<double> area(at(side * side * side));
  std::fill_n(area.begin(), bits, 1.0);
  return CellGrid(side, area);
}

extractor::PooledExtractor<float> pooled_reader(const MarkSite& site, Index channels) {
  if (site.cells.count() != site.bits)
    throw ValueError("[owner] cells must be message_slots(bits) for a mark without cells: " +
                     std::to_string(site.bits) + ", got " + std::to_string(site.cells.count()));
  return {site.params, "extractor", {.n_bits = site.bits, .channels = channels}, site.seed + 200};
}

std::vector<double> PooledMark::evidence(const Owner& owner, const Tensor<float>& image, SeenPlaces*) const {
  Tape<float> tape;
  const Var<float> read =
      logits(reader_, Params<float>(owner.params, nullptr), tape.constant(image), image.shape);
  return {read.value(), read.value() + read.shape().size()};
}

std::function<Var<float>(Var<float>)> PooledMark::confirmation(const Owner& owner,
                                                               const Tensor<float>& image) const {
  std::vector<float> bits;
  for (const double s : evidence(owner, image, nullptr)) bits.push_back(s > 0 ? 1.f : 0.f);
  return [this, params = Params<float>(owner.params, nullptr), shape = image.shape,
          bits = std::move(bits)](Var<float> other) {
    return bce_with_logits<float>(logits(reader_, params, other, shape), bits);
  };
}

std::unique_ptr<MarkTraining> PooledMark::training(const Owner& owner,
                                                   std::span<const CachedView> views) const {
  return std::make_unique<PooledTraining>(reader_, training_, owner, views, painter(owner, views));
}

}  // namespace fieldmark::watermark
