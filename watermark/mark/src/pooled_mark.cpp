#include <fieldmark/engine/ops/loss.h>
#include <fieldmark/watermark/mark/fusion_mark.h>
#include <fieldmark/watermark/mark/owner.h>

#include "pooled_training.h"

namespace fieldmark::watermark {
namespace {

// Returns the logits of one image.
Var<float> logits(const extractor::PooledExtractor<float>& reader, bool running, const Params<float>& params,
                  Var<float> image, const Shape& size) {
  const Var<float> batch = image.tape().reshape(image, {1, size[0], size[1], 3});
  const Var<float> out = running ? reader.evaluate(params, batch) : reader(params, batch);
  return image.tape().reshape(out, {out.shape().size()});
}

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
      logits(reader_, running_norm_, Params<float>(owner.params, nullptr), tape.constant(image), image.shape);
  return {read.value(), read.value() + read.shape().size()};
}

std::function<Var<float>(Var<float>)> PooledMark::confirmation(const Owner& owner,
                                                               const Tensor<float>& image) const {
  std::vector<float> bits;
  for (const double s : evidence(owner, image, nullptr)) bits.push_back(s > 0 ? 1.f : 0.f);
  return [this, params = Params<float>(owner.params, nullptr), shape = image.shape,
          bits = std::move(bits)](Var<float> other) {
    return bce_with_logits<float>(logits(reader_, running_norm_, params, other, shape), bits);
  };
}

std::unique_ptr<MarkTraining> PooledMark::training(const Owner& owner,
                                                   std::span<const CachedView> views) const {
  return std::make_unique<PooledTraining>(reader_, training_, running_norm_, owner, views,
                                          painter(owner, views), learner(owner, views));
}

}  // namespace fieldmark::watermark
