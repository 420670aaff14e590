#include <algorithm>

#include "image_corrections.h"
#include "trainer_shard.h"

// What training learns about its images in addition to the field: exposures and camera motions.

namespace fieldmark::nerf {
namespace {

// Returns the median distance of the field's cameras from the point that they look at.
double median_distance(const CameraSpan& span) {
  std::vector<double> distances = span.distances;
  const auto middle = distances.begin() + std::ssize(distances) / 2;
  std::nth_element(distances.begin(), middle, distances.end());
  return *middle;
}

}  // namespace

void Trainer::prepare_images() {
  for (const View& v : data_.views) cameras_.push_back(v.camera);
  if (!options_.image_colours && !options_.refine_poses) return;
  images_ =
      std::make_unique<ImageCorrections>(ImageCorrectionOptions{.images = std::ssize(data_.views),
                                                                .colour = options_.image_colours,
                                                                .pose = options_.refine_poses,
                                                                .length = median_distance(field_.cameras)});
  train(images_->params, {.lr = 1, .beta2 = 0.99, .eps = 1e-15, .zero_grads = true}, images_->ranges(),
        "image/");
  for (Shard& s : shards_) s.image_grads.resize(at(images_->params.size()));
}

void Trainer::place_cameras() {
  if (!options_.refine_poses) return;
  for (std::size_t v = 0; v < cameras_.size(); ++v)
    cameras_[v] = images_->moved(data_.views[v].camera, static_cast<Index>(v));
}

Var<float> Trainer::coloured(Var<float> pixels, Shard& c) const {
  return images_ ? images_->coloured(pixels, c.images, c.image_grads.data()) : pixels;
}

void Trainer::add_motions(const float* ddensity, const float* dcolour, Shard& c) const {
  const HashEncoding<float>& encoding = field_.field.encoding();
  const RaySamples& s = c.found;
  c.dposition.assign(s.position.size(), 0.f);
  encoding.backward_positions(field_.params.values(encoding.table()), s.position.data(), s.size(), ddensity,
                              dcolour, c.dposition.data());
  const Index rays = std::ssize(s.ray_begin) - 1, along = rays / std::ssize(c.images);
  for (Index r = 0; r < rays; ++r) {
    const std::size_t begin = at(3 * s.ray_begin[at(r)]), count = at(3 * s.ray_begin[at(r + 1)]) - begin;
    const Index image = c.images[at(r / along)];
    images_->add_motion(image, cameras_[at(image)], field_.space, std::span(s.position).subspan(begin, count),
                        std::span(c.dposition).subspan(begin, count), c.image_grads.data());
  }
}

void Trainer::step_images() {
  if (!images_) return;
  const std::span<float> grads = images_->params.grads();
  for (const Shard& s : shards_)
    for (std::size_t i = 0; i < grads.size(); ++i) grads[i] += s.image_grads[i];
  update(1);
  if (!options_.freeze) images_->hold_means();
}

std::vector<Camera> Trainer::cameras() const {
  std::vector<Camera> cameras;
  for (std::size_t v = 0; v < data_.views.size(); ++v) {
    const Camera& given = data_.views[v].camera;
    cameras.push_back(images_ ? images_->moved(given, static_cast<Index>(v)) : given);
  }
  return cameras;
}

std::span<const float> Trainer::image_colours() const {
  if (!options_.image_colours) return {};
  return std::as_const(images_->params).values(images_->params.find("colour"));
}

}  // namespace fieldmark::nerf
