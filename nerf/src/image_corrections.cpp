#include "image_corrections.h"

#include <fieldmark/nerf/colour_affine.h>

#include <cmath>

#include "checks.h"
#include "vec3.h"

namespace fieldmark::nerf {
namespace {

constexpr double kColourStep = 0.2, kPoseStep = 0.05;  // relative to the field's step size
// Decay towards the identity: an image of one colour determines nothing about other colours.
constexpr double kColourDecay = 0.02;

// sin(a) / a, (1 - cos(a)) / a^2 and (a - sin(a)) / a^3.
struct RotationTerms {
  double a, b, c;
  explicit RotationTerms(double angle) {
    const double x = angle * angle;
    if (angle < 1e-2) {  // the omitted terms are below 1e-14
      a = 1 - x / 6 * (1 - x / 20), b = 0.5 - x / 24 * (1 - x / 30), c = 1. / 6 - x / 120 * (1 - x / 42);
    } else {
      a = std::sin(angle) / angle, b = (1 - std::cos(angle)) / x, c = (1 - a) / x;
    }
  }
};

// Rodrigues: exp(w) v.
Vec3 rotated(const Vec3& w, const Vec3& v) {
  const RotationTerms t(norm(w));
  const Vec3 across = cross(w, v);
  return v + t.a * across + t.b * cross(w, across);
}

}  // namespace

ImageCorrections::ImageCorrections(const ImageCorrectionOptions& options) : options_(options) {
  if (options.colour) colour_ = params.add("colour", {options.images, 12});
  if (options.pose) pose_ = params.add("pose", {options.images, 6});
}

Var<float> ImageCorrections::coloured(Var<float> rays, std::span<const Index> image, float* grads) const {
  if (!colour_) return rays;
  return colour_affine(rays, Params<float>(params, grads).leaf(rays.tape(), *colour_), image);
}

Camera ImageCorrections::moved(const Camera& camera, Index image) const {
  if (!pose_) return camera;
  const float* p = params.values(*pose_).data() + 6 * image;
  const Vec3 w{p[0], p[1], p[2]};
  Camera out = camera;
  for (std::size_t c = 0; c < 3; ++c) {
    const Vec3 axis = rotated(w, {camera.pose[c], camera.pose[4 + c], camera.pose[8 + c]});
    for (std::size_t r = 0; r < 3; ++r) out.pose[4 * r + c] = axis[r];
  }
  for (std::size_t r = 0; r < 3; ++r) out.pose[4 * r + 3] += options_.length * static_cast<double>(p[3 + r]);
  return out;
}

void ImageCorrections::add_motion(Index image, const Camera& camera, const Space& space,
                                  std::span<const float> x, std::span<const float> dx, float* grads) const {
  const Vec3 eye = camera.position();
  Vec3 shift{}, turn{};
  for (std::size_t i = 0; i < x.size(); i += 3) {
    const Vec3 p = space.to_world({x[i], x[i + 1], x[i + 2]});
    if (!std::isfinite(norm(p))) continue;  // on the cube's face at infinity
    const Vec3 h = space.gradient_in_world(p, {dx[i], dx[i + 1], dx[i + 2]});
    shift = shift + h;
    turn = turn + cross(p - eye, h);
  }
  const float* values = params.values(*pose_).data() + 6 * image;
  const Vec3 w{values[0], values[1], values[2]};
  const RotationTerms t(norm(w));
  // J(w) = I + b [w] + c [w]^2, and [w]^T = -[w].
  const Vec3 across = cross(w, turn);
  turn = turn + (-t.b) * across + t.c * cross(w, across);
  float* out = grads + params.entry(*pose_).offset + 6 * image;
  for (std::size_t a = 0; a < 3; ++a) {
    out[a] += static_cast<float>(turn[a]);
    out[3 + a] += static_cast<float>(options_.length * shift[a]);
  }
}

void ImageCorrections::hold_means() {
  for (const auto& e : params.entries()) {
    const std::span<float> values = params.values(params.find(e.name));
    const Index width = e.shape[1];
    for (Index k = 0; k < width; ++k) {
      double sum = 0;
      for (Index v = 0; v < options_.images; ++v) sum += static_cast<double>(values[at(v * width + k)]);
      const auto mean = static_cast<float>(sum / static_cast<double>(options_.images));
      for (Index v = 0; v < options_.images; ++v) values[at(v * width + k)] -= mean;
    }
  }
}

std::vector<AdamRange> ImageCorrections::ranges() const {
  std::vector<AdamRange> ranges;
  for (const auto& e : params.entries())
    ranges.push_back({.begin = e.offset,
                      .end = e.offset + e.shape.size(),
                      .lr_factor = e.name == "pose" ? kPoseStep : kColourStep,
                      .weight_decay = e.name == "pose" ? 0 : kColourDecay});
  return ranges;
}

}  // namespace fieldmark::nerf
