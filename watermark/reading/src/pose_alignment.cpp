#include "pose_alignment.h"
#include <fieldmark/engine/shape_checks.h>
#include <fieldmark/imaging/resize.h>
#include <fieldmark/watermark/mark/view_cache.h>
#include "camera_motion.h"
#include "nearest_sample.h"
#include "plain_border.h"
#include "tone_fit.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "blurred.h"
#include "ordered_sum.h"

namespace fieldmark::watermark {
namespace {

constexpr Index kParameters = 10;
constexpr int kTonePasses = 2;
constexpr double kToneHold = 1e-4;  // tones that bend more make wrong views agree
constexpr double kNear = 1.5;  // of the motion that ends a stage: less, without a lower cost, ends it, too
constexpr int kMostFailures = 3;
constexpr double kOverRelaxation = 1.5;  // reweighting overestimates the curvature: steps fall short
constexpr double kDamping = 1e-3;

using Matrix = Eigen::Matrix<double, kParameters, kParameters>;
using Vector = Eigen::Matrix<double, kParameters, 1>;

// A camera's render and the quantities compared with the image, at the stage's size.
struct Look {
  nerf::Camera camera;
  Tensor<float> render;            // blurred
  Tensor<float> toned;             // the render in the image's colours
  std::vector<std::int32_t> seen;  // [P] sample of the pixel or of its nearest neighbour; -1: none
  std::vector<nerf::Vec3> points;  // [samples] world
  nerf::Vec3 pivot{};
  std::vector<double> rest;  // [P, 3] image minus toned render
  double spread = 0;         // of the residuals
};

// The sums of a Gauss-Newton step.
struct NormalEquations {
  Matrix h = Matrix::Zero();
  Vector g = Vector::Zero();
  NormalEquations& operator+=(const NormalEquations& other) {
    h += other.h;
    g += other.g;
    return *this;
  }
  void hold(int k) {
    h.row(k).setZero();
    h.col(k).setZero();
    h(k, k) = 1;
    g[k] = 0;
  }
};

double slope_x(const Tensor<float>& t, Index y, Index x, Index c) {
  const Index w = t.shape[1], a = std::max<Index>(x - 1, 0), b = std::min(x + 1, w - 1);
  return static_cast<double>(t[(y * w + b) * 3 + c] - t[(y * w + a) * 3 + c]) / static_cast<double>(b - a);
}

double slope_y(const Tensor<float>& t, Index y, Index x, Index c) {
  const Index w = t.shape[1], a = std::max<Index>(y - 1, 0), b = std::min(y + 1, t.shape[0] - 1);
  return static_cast<double>(t[(b * w + x) * 3 + c] - t[(a * w + x) * 3 + c]) / static_cast<double>(b - a);
}

// The image at one stage's size, and the optimisation there.
class Stage {
 public:
  // border: [H W] 1 where the image shows no scene; empty if it shows the scene everywhere
  Stage(nerf::Renderer& renderer, const nerf::RadianceField& field, const Tensor<float>& image,
        const std::vector<std::uint8_t>& border, const AlignmentStage& options)
      : renderer_(renderer), field_(field), options_(options) {
    const Index longer = std::max(image.shape[0], image.shape[1]);
    const double zoom = static_cast<double>(std::min(options.size, longer)) / static_cast<double>(longer);
    const auto side = [&](Index n) { return std::max<Index>(2, std::lround(zoom * static_cast<double>(n))); };
    image_ = blurred(resize_area(image, side(image.shape[0]), side(image.shape[1])), options.blur);
    if (!border.empty())
      border_ = border_at(border, image.shape[0], image.shape[1], image_.shape[0], image_.shape[1], reach());
  }

  // Renders the field from a camera and compares it with the image.
  Look look(const nerf::Camera& camera) {
    Look l;
    l.camera = camera.scaled(image_.shape[1], image_.shape[0]);
    const CachedView view = cache_view(renderer_, field_, l.camera);
    l.render = blurred(view.base, options_.blur);
    l.seen = nearest_sample(view, reach());
    for (std::size_t p = 0; p < border_.size(); ++p)
      if (border_[p]) l.seen[p] = -1;
    double total = 0, depth = 0;
    for (std::size_t k = 0; k < view.weight.size(); ++k) {
      const float* x = &view.position[3 * k];
      l.points.push_back(field_.space.to_world(
          {static_cast<double>(x[0]), static_cast<double>(x[1]), static_cast<double>(x[2])}));
      const double d = project(l.camera, l.points.back()).depth;
      if (!(d > 0)) continue;
      total += 1;
      depth += 1 / d;
    }
    // Uses the mean inverse depth, so that a far background does not pull the pivot away.
    if (total > 0) {
      const nerf::Vec3 eye = l.camera.position(), ahead = l.camera.forward();
      for (std::size_t a = 0; a < 3; ++a) l.pivot[a] = eye[a] + total / depth * ahead[a];
    }
    compare(l);
    return l;
  }

  // Fits the image's colours, and sets the toned render, the residuals and their spread.
  void compare(Look& l) const {
    std::vector<double> weight(l.seen.size());
    for (std::size_t p = 0; p < weight.size(); ++p) weight[p] = l.seen[p] >= 0 ? 1 : 0;
    RobustTones fit = fit_tones_robustly(l.render, image_, weight, kTonePasses, kToneHold);
    l.toned = std::move(fit.toned);
    l.rest = std::move(fit.rest);
    l.spread = fit.spread;
  }

  // Returns the mean cost of the residuals, NaN if the look sees nothing. Costs are comparable only under
  // one spread.
  static double cost(const Look& l, double spread) {
    const double sum = ordered_sum(std::ssize(l.seen), 0.0, [&](Index begin, Index end, double& part) {
      for (Index i = 3 * begin; i < 3 * end; ++i)
        if (l.seen[at(i / 3)] >= 0) part += std::log1p(std::pow(l.rest[at(i)] / (kCauchy * spread), 2));
    });
    return sum / static_cast<double>(3 * std::ranges::count_if(l.seen, [](auto s) { return s >= 0; }));
  }

  // Gauss-Newton: with a = grad B . dx/dmotion, the toned render after a motion m is B - a m, so
  // sum w a a^T m = -sum w a r.
  NormalEquations normal_equations(const Look& l) const {
    const auto add = [&](Index begin, Index end, NormalEquations& sums) {
      for (Index p = begin; p < end; ++p) add_pixel(l, p, sums);
    };
    NormalEquations sums = ordered_sum(std::ssize(l.seen), NormalEquations{}, add);
    if (!options_.lens)  // zoom and slide replace distance and aim
      for (const int k : {3, 4, 5}) sums.hold(k);
    if (!options_.stretched) sums.hold(9);
    return sums;
  }

  void add_pixel(const Look& l, Index p, NormalEquations& sums) const {
    const std::int32_t s = l.seen[at(p)];
    if (s < 0 || !(project(l.camera, l.points[at(s)]).depth > 0)) return;
    const Index width = image_.shape[1];
    const auto j = motion_gradient(l.camera, l.pivot, l.points[at(s)]);
    const Eigen::Map<const Vector> jx(j[0].data()), jy(j[1].data());
    double xx = 0, xy = 0, yy = 0, xr = 0, yr = 0;
    for (Index c = 0; c < 3; ++c) {
      const double difference = l.rest[at(3 * p + c)];
      const double w = 1 / (1 + std::pow(difference / (kCauchy * l.spread), 2));
      const double bx = slope_x(l.toned, p / width, p % width, c),
                   by = slope_y(l.toned, p / width, p % width, c);
      xx += w * bx * bx;
      xy += w * bx * by;
      yy += w * by * by;
      xr += w * bx * difference;
      yr += w * by * difference;
    }
    sums.h += xx * jx * jx.transpose() + yy * jy * jy.transpose() +
              xy * (jx * jy.transpose() + jy * jx.transpose());
    sums.g -= xr * jx + yr * jy;
  }

  // Occlusions of the view, such as a caption, differ by far more than the rest and so hardly count.
  double agreement(const Look& l) const {
    double ab = 0, aa = 0, bb = 0;
    const Index width = image_.shape[1];
    const double far = std::pow(kCauchy * l.spread, 2);
    for (Index p = 0; p < static_cast<Index>(l.seen.size()); ++p) {
      if (l.seen[at(p)] < 0) continue;
      double difference = 0;
      for (Index c = 0; c < 3; ++c)
        difference += std::pow(static_cast<double>(image_[3 * p + c] - l.toned[3 * p + c]), 2) / 3;
      const double weight = 1 / (1 + difference / far);
      for (Index c = 0; c < 3; ++c) {
        const double ax = slope_x(image_, p / width, p % width, c),
                     ay = slope_y(image_, p / width, p % width, c),
                     bx = slope_x(l.toned, p / width, p % width, c),
                     by = slope_y(l.toned, p / width, p % width, c);
        ab += weight * (ax * bx + ay * by);
        aa += weight * (ax * ax + ay * ay);
        bb += weight * (bx * bx + by * by);
      }
    }
    return aa > 0 && bb > 0 ? ab / std::sqrt(aa * bb) : -1;
  }

  Alignment run(const nerf::Camera& start) {
    Look best = look(start);
    NormalEquations sums = normal_equations(best);
    double least = cost(best, best.spread), damping = kDamping, length = kOverRelaxation;
    int failures = 0;
    for (int step = 0; step < options_.steps && !best.points.empty() && failures < kMostFailures; ++step) {
      Matrix damped = sums.h;
      damped.diagonal() = (1 + damping) * sums.h.diagonal().array() + 1e-6 * sums.h.diagonal().maxCoeff();
      const Vector newton = damped.ldlt().solve(sums.g);
      if (!newton.allFinite()) break;
      const CameraMotion motion = limited(length * newton);
      const double far = furthest(best, motion);
      if (far < options_.still && failures > 0) break;  // the linear model has just failed
      if (far < options_.still)
        return {moved(best.camera, best.pivot, limited(newton)), agreement(best), shown(best)};
      Look next = look(moved(best.camera, best.pivot, motion));
      if (next.points.empty() || !(cost(next, best.spread) < least)) {
        if (far < kNear * options_.still) break;
        damping *= 10;
        length = 1;
        ++failures;
        continue;
      }
      best = std::move(next);
      sums = normal_equations(best);
      least = cost(best, best.spread);
      damping = std::max(1e-6, damping / 4);
      length = kOverRelaxation;
      failures = 0;
    }
    return {best.camera, best.points.empty() ? -1 : agreement(best), shown(best)};
  }

 private:
  static double shown(const Look& l) {
    return static_cast<double>(l.points.size()) / static_cast<double>(l.seen.size());
  }
  Index reach() const { return static_cast<Index>(std::ceil(2 * options_.blur)); }

  static CameraMotion limited(const Vector& m) {
    CameraMotion motion;
    Eigen::Map<Vector>(motion.data()) = m.cwiseMax(-0.3).cwiseMin(0.3);
    return motion;
  }

  // Returns the largest displacement of a point under a motion, pixels.
  static double furthest(const Look& l, const CameraMotion& motion) {
    const Eigen::Map<const Vector> m(motion.data());
    double most = 0;
    for (std::size_t k = 0; k < l.points.size(); k += 16) {
      const auto j = motion_gradient(l.camera, l.pivot, l.points[k]);
      most = std::max(most, std::hypot(Eigen::Map<const Vector>(j[0].data()).dot(m),
                                       Eigen::Map<const Vector>(j[1].data()).dot(m)));
    }
    return most;
  }

  nerf::Renderer& renderer_;
  const nerf::RadianceField& field_;
  AlignmentStage options_;
  Tensor<float> image_;
  std::vector<std::uint8_t> border_;  // at the stage's size
};

}  // namespace

bool is_inexact(const Alignment& alignment) {
  constexpr double kThin = 0.12, kLeast = 0.85, kExact = 0.997;
  return alignment.shown < kThin && alignment.agreement >= kLeast && alignment.agreement < kExact;
}

PoseAligner::PoseAligner(const nerf::RadianceField& field)
    : field_(field), renderer_(field, {.finer = 1}), quick_(field, {.finer = 0.5f}) {}

Alignment PoseAligner::align(const Tensor<float>& image, const nerf::Camera& start,
                             std::span<const AlignmentStage> stages,
                             const std::vector<std::uint8_t>& covered) {
  check_rank("pose_aligner", "image", image.shape, 3, "[H, W, 3]");
  check_extent("pose_aligner", "image", image.shape, 2, 3, "red, green, blue");
  if (stages.empty()) throw ValueError("[pose_aligner] stages must not be empty");
  for (const AlignmentStage& stage : stages)
    if (stage.size < 16)
      throw ValueError("[pose_aligner] stages must be of at least 16 pixels, got " +
                       std::to_string(stage.size));
  const auto border = covered.empty() ? border_of(field_, image) : covered;
  Alignment out{start, -1};
  for (const AlignmentStage& stage : stages) {
    out = Stage(stage.quick ? quick_ : renderer_, field_, image, border, stage).run(out.camera);
    if (out.agreement < stage.least) break;
  }
  out.camera = out.camera.scaled(image.shape[1], image.shape[0]);
  return out;
}

}  // namespace fieldmark::watermark
