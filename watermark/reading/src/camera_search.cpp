#include "camera_search.h"
#include <fieldmark/distort/rotate.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/engine/random.h>
#include <fieldmark/imaging/resize.h>
#include <fieldmark/watermark/mark/cameras_around.h>
#include "camera_motion.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <numbers>

namespace fieldmark::watermark {
namespace {

using Complex = std::complex<double>;

constexpr Index kMostMatches = 240;  // places compared
constexpr std::size_t kLeastMatches = 8;
constexpr Index kDraws = 48;         // pairs of places per view
constexpr double kTolerance = 0.05;  // share of the window's longer side: about one cell
constexpr int kFitSteps = 12;
constexpr Index kSmall = 24;    // pixels of a window's side
constexpr Index kReduced = 96;  // longer side of the image before rotation
constexpr int kTurns = 24;      // of 15 degrees
constexpr Index kParts = 12;    // grid of a cropped image and of the windows it is compared with
constexpr std::array kSides{0.5, 0.57, 0.64, 0.72, 0.81, 0.92};  // share of the render's longer side
constexpr double kStride = 0.04;                                 // between windows, the same share

// Subtracts the mean and scales to length 1; a constant vector becomes 0.
void make_unit(std::span<float> v) {
  double mean = 0, square = 0;
  for (const float x : v) mean += static_cast<double>(x) / static_cast<double>(v.size());
  for (const float x : v) square += std::pow(static_cast<double>(x) - mean, 2);
  const double scale = square > 0 ? 1 / std::sqrt(square) : 0;
  for (float& x : v) x = static_cast<float>((static_cast<double>(x) - mean) * scale);
}

double correlation(std::span<const float> a, std::span<const float> b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += static_cast<double>(a[i] * b[i]);
  return sum;
}

std::vector<float> small_window(const Tensor<float>& image, const Window& window, float background) {
  std::vector<float> v = cut_window(image, window, square_patch(kSmall), background).data;
  make_unit(v);
  return v;
}

// Returns (max + min) / 2 of each pixel, in all channels.
Tensor<float> lightness(const Tensor<float>& image) {
  Tensor<float> out(image.shape);
  for (Index i = 0; i < image.size(); i += 3) {
    const auto [least, most] = std::minmax({image[i], image[i + 1], image[i + 2]});
    std::fill_n(&out[i], 3, 0.5f * (least + most));
  }
  return out;
}

Tensor<float> turned(const Tensor<float>& image, double angle, float background) {
  Tape<float> tape;
  const auto a = static_cast<float>(angle);
  const std::vector<float> around(3, background);
  const Var<float> y = distort::rotate(tape.constant(image), tape.constant(&a, {1}), around);
  return {y.shape(), std::vector<float>(y.value(), y.value() + y.shape().size())};
}

// Camera::scaled() rounds both sides and so changes the aspect of pixels, which no later motion corrects.
// This function keeps it; the right and lower edges move by up to half a pixel.
nerf::Camera reduced(const nerf::Camera& camera, Index size) {
  const double zoom = static_cast<double>(size) / static_cast<double>(std::max(camera.width, camera.height));
  nerf::Camera small = camera.scaled(size);
  small.fx = zoom * camera.fx;
  small.fy = zoom * camera.fy;
  small.cx = zoom * camera.cx;
  small.cy = zoom * camera.cy;
  return small;
}

Complex middle(const Window& w) { return {w.x + w.width / 2, w.y + w.height / 2}; }

// Returns the cameras that `camera_of` makes of the `count` best proposals with a positive score.
template <class Proposals, class F>
std::vector<nerf::Camera> best_cameras(Proposals& proposals, Index count, F camera_of) {
  std::ranges::stable_sort(proposals, [](const auto& p, const auto& q) { return p.score > q.score; });
  std::vector<nerf::Camera> cameras;
  for (const auto& p : proposals) {
    if (std::ssize(cameras) == count || !(p.score > 0)) break;
    cameras.push_back(camera_of(p));
  }
  return cameras;
}

}  // namespace

struct CameraSearch::Match {
  std::int32_t cell;
  Complex place;  // pixels of the image
  double share;
};

// Maps pixel u of a small view to a u + b in the image.
struct CameraSearch::Proposal {
  std::size_t view = 0;
  Complex a{1, 0}, b{};
  double score = -1;
};

CameraSearch::CameraSearch(const Owner& owner, const CameraSearchOptions& options)
    : owner_(owner), options_(options) {
  if (!owner.mark().has_cells())
    throw ValueError("[camera_search] owner must have cells in space, got one of preset " +
                     owner.mark().preset());
  if (options.views < 1 || options.around < 0 || options.size < 16)
    throw ValueError("[camera_search] views, around and size must be at least 1, 0 and 16, got " +
                     std::to_string(options.views) + ", " + std::to_string(options.around) + " and " +
                     std::to_string(options.size));
  nerf::Renderer renderer(owner.field, {.finer = 0.75f});  // pixels are large
  for (const nerf::Camera& whole :
       cameras_around(owner.field, options.views, options.around, 0, options.seed)) {
    const nerf::Camera camera = reduced(whole, options.size);
    const CachedView v = cache_view(renderer, owner.field, camera);
    SmallView view{camera, std::vector<std::int32_t>(at(owner.cells.count()), -1), {}, {}, {}, {}, {}};
    std::vector<double> weight;
    for (Index p = 0; p < v.height * v.width; ++p)
      for (std::int32_t k = v.sample_begin[at(p)]; k < v.sample_begin[at(p + 1)]; ++k) {
        const float* x = &v.position[3 * at(k)];
        const std::int32_t cell = owner.cells.at(x);
        if (cell < 0) continue;
        std::int32_t& entry = view.of_cell[at(cell)];
        if (entry < 0) {
          entry = static_cast<std::int32_t>(view.seen.size());
          view.seen.push_back({});
          weight.push_back(0);
        }
        SeenCell& seen = view.seen[at(entry)];
        const auto w = static_cast<double>(v.weight[at(k)]);
        weight[at(entry)] += w;
        const Index row = p / v.width;
        seen.x += w * (static_cast<double>(p % v.width) + 0.5);
        seen.y += w * (static_cast<double>(row) + 0.5);
        for (std::size_t a = 0; a < 3; ++a) seen.point[a] += w * static_cast<double>(x[a]);
      }
    for (std::size_t e = 0; e < weight.size(); ++e) {
      SeenCell& seen = view.seen[e];
      seen.x /= weight[e];
      seen.y /= weight[e];
      for (double& a : seen.point) a /= weight[e];
      seen.point = owner.field.space.to_world(seen.point);
    }
    const float background = nerf::background_value(owner.field.background);
    view.window = object_window(v.base, background);
    view.small = small_window(v.base, view.window, background);
    view.light = small_window(lightness(v.base), view.window, background);
    view.area = SummedArea(v.base);
    views_.push_back(std::move(view));
  }
}

CameraSearch::Proposal CameraSearch::propose(const SmallView& view, std::size_t number,
                                             const std::vector<Match>& matches, double tolerance) const {
  struct Pair {
    Complex from, to;
    double share;
  };
  std::vector<Pair> pairs;
  for (const Match& m : matches)
    if (const std::int32_t e = view.of_cell[at(m.cell)]; e >= 0)
      pairs.push_back({{view.seen[at(e)].x, view.seen[at(e)].y}, m.place, m.share});
  Proposal best{number};
  if (pairs.size() < kLeastMatches) return best;
  const CounterRng rng(options_.seed, 43);
  const auto n = static_cast<Index>(pairs.size());
  const auto agreeing = [&](const Proposal& p, const Pair& q) {
    const double d2 = std::norm(p.a * q.from + p.b - q.to) / (tolerance * tolerance);
    return d2 < 1 ? q.share * (1 - d2) : 0.0;
  };
  for (Index draw = 0; draw < kDraws; ++draw) {
    const Pair &p = pairs[at(rng.below(n, number, static_cast<std::uint64_t>(2 * draw)))],
               &q = pairs[at(rng.below(n, number, static_cast<std::uint64_t>(2 * draw + 1)))];
    if (std::abs(p.from - q.from) < 3 || std::abs(p.to - q.to) < 2 * tolerance) continue;
    Proposal proposal{number, (p.to - q.to) / (p.from - q.from)};
    proposal.b = p.to - proposal.a * p.from;
    proposal.score = 0;
    for (const Pair& pair : pairs) proposal.score += agreeing(proposal, pair);
    if (proposal.score > best.score) best = proposal;
  }
  // Least squares over the inlier pairs.
  for (int pass = 0; pass < 3 && best.score > 0; ++pass) {
    Complex from, to;
    double total = 0;
    std::vector<double> w;
    for (const Pair& p : pairs) {
      w.push_back(agreeing(best, p));
      total += w.back();
      from += w.back() * p.from;
      to += w.back() * p.to;
    }
    if (!(total > 0)) break;
    from /= total;
    to /= total;
    Complex cross;
    double square = 0;
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      cross += w[i] * std::conj(pairs[i].from - from) * (pairs[i].to - to);
      square += w[i] * std::norm(pairs[i].from - from);
    }
    if (!(square > 0)) break;
    Proposal next{number, cross / square};
    next.b = to - next.a * from;
    next.score = 0;
    for (const Pair& p : pairs) next.score += agreeing(next, p);
    if (!(next.score > best.score)) break;
    best = next;
  }
  return best;
}

// Returns the small view's camera, rolled, zoomed and shifted by the proposal.
nerf::Camera CameraSearch::proposed(const Proposal& proposal, Index height, Index width) const {
  const SmallView& view = views_[proposal.view];
  nerf::Camera camera = view.camera;
  const double zoom = std::abs(proposal.a), turn = std::arg(proposal.a);
  // y points down: a rotation of the image is the opposite rotation of the scene about the viewing axis.
  camera =
      moved(camera,
            nerf::Vec3{camera.position()[0] + camera.forward()[0], camera.position()[1] + camera.forward()[1],
                       camera.position()[2] + camera.forward()[2]},
            {0, 0, -turn});
  camera.fx *= zoom;
  camera.fy *= zoom;
  const Complex centre = proposal.a * Complex(view.camera.cx, view.camera.cy) + proposal.b;
  camera.cx = centre.real();
  camera.cy = centre.imag();
  camera.width = width;
  camera.height = height;
  return camera;
}

// Refines the proposed camera by Gauss-Newton on the distances of projected cells to their places.
nerf::Camera CameraSearch::fitted(const Proposal& proposal, const std::vector<Match>& matches,
                                  double tolerance, Index height, Index width) const {
  const SmallView& view = views_[proposal.view];
  nerf::Camera camera = proposed(proposal, height, width);
  using Matrix = Eigen::Matrix<double, 10, 10>;
  using Vector = Eigen::Matrix<double, 10, 1>;
  nerf::Vec3 pivot{};
  for (const SeenCell& s : view.seen)
    for (std::size_t a = 0; a < 3; ++a) pivot[a] += s.point[a] / static_cast<double>(view.seen.size());
  for (int step = 0; step < kFitSteps; ++step) {
    Matrix h = Matrix::Zero();
    Vector g = Vector::Zero();
    for (const Match& m : matches) {
      const std::int32_t e = view.of_cell[at(m.cell)];
      if (e < 0) continue;
      const nerf::Vec3& point = view.seen[at(e)].point;
      const Projection p = project(camera, point);
      if (!(p.depth > 0)) continue;
      const double dx = m.place.real() - p.x, dy = m.place.imag() - p.y;
      const double w = m.share / std::pow(1 + (dx * dx + dy * dy) / (tolerance * tolerance), 2);
      const auto j = motion_gradient(camera, pivot, point);
      const Eigen::Map<const Vector> jx(j[0].data()), jy(j[1].data());
      h += w * (jx * jx.transpose() + jy * jy.transpose());
      g += w * (dx * jx + dy * jy);
    }
    // Assumes that the image is not stretched.
    h.row(9).setZero();
    h.col(9).setZero();
    g[9] = 0;
    h.diagonal() = h.diagonal() * 1.02 + Vector::Constant(1e-3 * h.diagonal().maxCoeff());
    const Vector m = h.ldlt().solve(g);
    if (!m.allFinite()) break;
    CameraMotion motion;
    Eigen::Map<Vector>(motion.data()) = m.cwiseMax(-0.2).cwiseMin(0.2);
    camera = moved(camera, pivot, motion);
    if (!(project(camera, pivot).depth > 0)) return proposed(proposal, height, width);
  }
  return camera;
}

std::vector<nerf::Camera> CameraSearch::find(const SeenPlaces& places, Index height, Index width,
                                             Index count) const {
  std::vector<Match> matches;
  for (Index p = 0; p < places.height * places.width; ++p) {
    if (places.cell[at(p)] < 0) continue;
    const Index row = p / places.width;
    const double x = (static_cast<double>(p % places.width) + 0.5) / static_cast<double>(places.width),
                 y = (static_cast<double>(row) + 0.5) / static_cast<double>(places.height);
    matches.push_back(
        {places.cell[at(p)],
         {places.window.x + x * places.window.width, places.window.y + y * places.window.height},
         static_cast<double>(places.share[at(p)])});
  }
  if (matches.size() < kLeastMatches) return {};
  std::stable_sort(matches.begin(), matches.end(),
                   [](const Match& a, const Match& b) { return a.share > b.share; });
  if (static_cast<Index>(matches.size()) > kMostMatches) matches.resize(at(kMostMatches));

  const double tolerance = kTolerance * std::max(places.window.width, places.window.height);
  std::vector<Proposal> proposals(views_.size());
  parallel_for(static_cast<Index>(views_.size()), 8, [&](Index begin, Index end) {
    for (Index v = begin; v < end; ++v) proposals[at(v)] = propose(views_[at(v)], at(v), matches, tolerance);
  });
  return best_cameras(proposals, count,
                      [&](const Proposal& p) { return fitted(p, matches, tolerance, height, width); });
}

std::vector<CameraSearch::Proposal> CameraSearch::by_content(const Tensor<float>& image,
                                                             std::vector<float> SmallView::*content) const {
  const float background = nerf::background_value(owner_.field.background);
  const Index h = image.shape[0], w = image.shape[1];
  const double zoom = std::min(1.0, static_cast<double>(kReduced) / static_cast<double>(std::max(h, w)));
  const auto side = [&](Index n) { return std::max<Index>(1, std::lround(zoom * static_cast<double>(n))); };
  const Tensor<float> reduced = resize_area(image, side(h), side(w));
  const Complex centre(0.5 * static_cast<double>(side(w)), 0.5 * static_cast<double>(side(h)));
  std::vector<Proposal> best(views_.size());
  for (int turn = 0; turn < kTurns; ++turn) {
    const double angle = 2 * std::numbers::pi * turn / kTurns;
    const Tensor<float> upright = turned(reduced, angle, background);
    const Window window = object_window(upright, background);
    const std::vector<float> small = small_window(upright, window, background);
    for (std::size_t v = 0; v < views_.size(); ++v) {
      const double score = correlation(small, views_[v].*content);
      if (score <= best[v].score) continue;
      // Pixel u of the render is (u - middle) width / width' + middle' in the rotated image, which shows
      // pixel q of the image at e^(-i angle) (q - centre) + centre, since y points down.
      const Complex back = std::polar(1.0, angle);
      const Complex a = back * window.width / views_[v].window.width;
      const Complex b = back * (middle(window) - centre) + centre - a * middle(views_[v].window);
      best[v] = {v, a / zoom, b / zoom, score};
    }
  }
  return best;
}

std::vector<nerf::Camera> CameraSearch::find(const Tensor<float>& image, Index count) const {
  std::vector<Proposal> proposals = by_content(image, &SmallView::small);
  return best_cameras(proposals, count,
                      [&](const Proposal& p) { return proposed(p, image.shape[0], image.shape[1]); });
}

std::vector<nerf::Camera> CameraSearch::find_by_lightness(const Tensor<float>& image, Index count) const {
  std::vector<Proposal> proposals = by_content(lightness(image), &SmallView::light);
  return best_cameras(proposals, count,
                      [&](const Proposal& p) { return proposed(p, image.shape[0], image.shape[1]); });
}

double CameraSearch::likeness(const Tensor<float>& image) const {
  double most = -1;
  for (const Proposal& p : by_content(image, &SmallView::small)) most = std::max(most, p.score);
  return most;
}

CameraSearch::Proposal CameraSearch::best_part(std::size_t number, std::span<const float> image,
                                               double height_to_width) const {
  const SummedArea& area = views_[number].area;
  const double longer = static_cast<double>(std::max(area.height(), area.width()));
  std::vector<float> parts(image.size());
  Proposal best{number};
  for (const double side : kSides) {
    const double wide = side * longer / std::max(1.0, height_to_width), high = wide * height_to_width;
    for (double top = 0; top + high <= static_cast<double>(area.height()); top += kStride * longer)
      for (double left = 0; left + wide <= static_cast<double>(area.width()); left += kStride * longer) {
        area.means(left, top, wide, high, kParts, parts);
        make_unit(parts);
        if (const double score = correlation(parts, image); score > best.score)
          best = {number, 1 / wide, Complex(-left, -top) / wide, score};
      }
  }
  return best;
}

std::vector<nerf::Camera> CameraSearch::find_part(const Tensor<float>& image, Index count) const {
  const Index h = image.shape[0], w = image.shape[1];
  std::vector<float> parts(at(kParts * kParts * 3));
  SummedArea(image).means(0, 0, static_cast<double>(w), static_cast<double>(h), kParts, parts);
  make_unit(parts);
  std::vector<Proposal> best(views_.size());
  parallel_for(std::ssize(views_), 8, [&](Index begin, Index end) {
    for (Index v = begin; v < end; ++v)
      best[at(v)] = best_part(at(v), parts, static_cast<double>(h) / static_cast<double>(w));
  });
  for (Proposal& p : best) {
    p.a *= static_cast<double>(w);
    p.b *= static_cast<double>(w);
  }
  return best_cameras(best, count, [&](const Proposal& p) { return proposed(p, h, w); });
}

}  // namespace fieldmark::watermark
