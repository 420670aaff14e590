#include "lens.h"

#include <fieldmark/core/error.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace fieldmark::nerf {
namespace {

// The radial factor a of a lens, and da / d(r^2).
struct Radial {
  double a, slope;
};

Radial fisheye_radial(const Lens& l, double r2) {
  // Close to the axis the quotients below lose precision: t / r = 1 - r^2 / 3 + O(r^4).
  if (r2 < 1e-8) return {1 + r2 * (l.k1 - 1.0 / 3), l.k1 - 1.0 / 3};
  const double r = std::sqrt(r2), t = std::atan(r), t2 = t * t;
  const double seen = t * (1 + t2 * (l.k1 + t2 * (l.k2 + t2 * (l.k3 + t2 * l.k4))));
  const double along = (1 + t2 * (3 * l.k1 + t2 * (5 * l.k2 + t2 * (7 * l.k3 + t2 * 9 * l.k4)))) / (1 + r2);
  return {seen / r, (along - seen / r) / (2 * r2)};
}

Radial radial(const Lens& l, double r2) {
  if (l.model == LensModel::fisheye) return fisheye_radial(l, r2);
  if (l.model == LensModel::polynomial)
    return {1 + r2 * (l.k1 + r2 * (l.k2 + r2 * (l.k3 + r2 * l.k4))),
            l.k1 + r2 * (2 * l.k2 + r2 * (3 * l.k3 + r2 * 4 * l.k4))};
  const double above = 1 + r2 * (l.k1 + r2 * (l.k2 + r2 * l.k3)),
               below = 1 + r2 * (l.k4 + r2 * (l.k5 + r2 * l.k6));
  const double rise = l.k1 + r2 * (2 * l.k2 + r2 * 3 * l.k3), fall = l.k4 + r2 * (2 * l.k5 + r2 * 3 * l.k6);
  // Beyond a pole the lens has no image; NaN is neither regular nor inside an image.
  if (!(below > 0)) return {std::nan(""), std::nan("")};
  return {above / below, (rise * below - above * fall) / (below * below)};
}

// Returns the derivative of distorted(), a symmetric 2x2 matrix: xx, xy, yy.
std::array<double, 3> derivative(const Lens& l, const Vec2& q) {
  const double x = q[0], y = q[1];
  const auto [a, slope] = radial(l, x * x + y * y);
  return {a + 2 * x * x * slope + 2 * l.p1 * y + 6 * l.p2 * x,
          2 * x * y * slope + 2 * l.p1 * x + 2 * l.p2 * y,
          a + 2 * y * y * slope + 6 * l.p1 * y + 2 * l.p2 * x};
}
double determinant(const std::array<double, 3>& m) { return m[0] * m[2] - m[1] * m[1]; }

// Returns the step of Newton's method that brings distorted(q) closer by f.
Vec2 newton_step(const std::array<double, 3>& derivative, const Vec2& f) {
  const auto& m = derivative;
  const double d = determinant(m);
  return {(m[1] * f[1] - m[2] * f[0]) / d, (m[1] * f[0] - m[0] * f[1]) / d};
}

Vec2 on_plane(const Camera& c, double x, double y) { return {(x - c.cx) / c.fx, (y - c.cy) / c.fy}; }
Vec2 on_image(const Camera& c, const Vec2& q) { return {q[0] * c.fx + c.cx, q[1] * c.fy + c.cy}; }

std::string short_number(double x) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", x);
  return text;
}

// Describes a camera whose lens has no inverse; lengths that are not in pixels are a frequent cause.
std::string camera_text(const Camera& c) {
  return std::to_string(c.width) + " x " + std::to_string(c.height) + " with focal length " +
         short_number(c.fx) + " and principal point (" + short_number(c.cx) + ", " + short_number(c.cy) +
         "); check that these are pixels, and that the distortion belongs to them";
}

void check_invertible(const Camera& c, const Lens& lens) {
  constexpr int kSteps = 32;
  for (int i = 0; i <= kSteps; ++i)
    for (int j = 0; j <= kSteps; ++j) {
      const double x = static_cast<double>(c.width) * j / kSteps;
      const double y = static_cast<double>(c.height) * i / kSteps;
      if (!lens.undistorted(on_plane(c, x, y)))
        throw ValueError("[covered_part] lens: must have an inverse everywhere in the image, got " +
                         lens.text() + ", which has none at pixel (" + short_number(x) + ", " +
                         short_number(y) + ") of " + camera_text(c));
    }
}

// Checks that the lens can be inverted over the part of the pinhole's image to which the lens's image is
// resampled.
void check_inverse(const Camera& c, const Lens& lens, const Crop& part) {
  constexpr int kSteps = 32;
  constexpr double kPixels = 1e-6;
  for (int i = 0; i <= kSteps; ++i)
    for (int j = 0; j <= kSteps; ++j) {
      const double x =
          static_cast<double>(part.left) + 0.5 + static_cast<double>(part.width - 1) * j / kSteps;
      const double y =
          static_cast<double>(part.top) + 0.5 + static_cast<double>(part.height - 1) * i / kSteps;
      const Vec2 q = on_plane(c, x, y);
      const auto back = lens.undistorted(lens.distorted(q));
      if (!back || !(std::hypot((*back)[0] - q[0], (*back)[1] - q[1]) * std::max(c.fx, c.fy) < kPixels))
        throw ValueError("[covered_part] lens: must have an inverse to 1e-6 pixels, got " + lens.text() +
                         ", which has none at pixel (" + short_number(x) + ", " + short_number(y) + ") of " +
                         camera_text(c));
    }
}

// Returns true if a pixel of the pinhole has a source in the lens's image.
bool has_source(const Camera& c, const Lens& lens, Index column, Index row) {
  const Vec2 q = on_plane(c, static_cast<double>(column) + 0.5, static_cast<double>(row) + 0.5);
  const Vec2 p = on_image(c, lens.distorted(q));
  return p[0] >= 0 && p[1] >= 0 && p[0] <= static_cast<double>(c.width) &&
         p[1] <= static_cast<double>(c.height) && lens.is_regular(q);
}

double missing_share(const Camera& c, const Lens& lens, const Crop& r, int side) {
  const bool upright = side < 2;
  const Index length = upright ? r.height : r.width;
  Index missing = 0;
  for (Index i = 0; i < length; ++i) {
    const Index column = upright ? (side == 0 ? r.left : r.left + r.width - 1) : r.left + i;
    const Index row = upright ? r.top + i : (side == 2 ? r.top : r.top + r.height - 1);
    missing += has_source(c, lens, column, row) ? 0 : 1;
  }
  return static_cast<double>(missing) / static_cast<double>(length);
}

// Inverts distorted() from a start that it maps to within a pixel of `seen`. Close to a fold this may fail,
// and then Lens::undistorted() decides. @param enough  length of the remaining error
std::optional<Vec2> undistorted_near(const Lens& lens, const Vec2& seen, Vec2 q, double enough) {
  constexpr int kPlaces = 4;  // tried, the start among them
  for (int place = 0; place < kPlaces; ++place) {
    const Vec2 p = lens.distorted(q), f{p[0] - seen[0], p[1] - seen[1]};
    const auto m = derivative(lens, q);
    if (!(determinant(m) > 0 && m[0] + m[2] > 0)) break;
    if (std::hypot(f[0], f[1]) < enough) return q;
    const Vec2 move = newton_step(m, f);
    q = {q[0] + move[0], q[1] + move[1]};
  }
  return lens.undistorted(seen);
}

// Adds weight times a pixel, clamped to the image, to premultiplied colour and alpha.
void add_pixel(const Tensor<float>& rgba, Index column, Index row, double weight, double* sum) {
  const Index height = rgba.shape[0], width = rgba.shape[1];
  const Index y = std::clamp<Index>(row, 0, height - 1), x = std::clamp<Index>(column, 0, width - 1);
  const float* in = rgba.data.data() + 4 * (y * width + x);
  for (int k = 0; k < 3; ++k) sum[k] += weight * in[3] * in[k];
  sum[3] += weight * in[3];
}

void sample(const Tensor<float>& rgba, const Vec2& at, float* out) {
  const double x = at[0] - 0.5, y = at[1] - 0.5, x0 = std::floor(x), y0 = std::floor(y);
  const double u = x - x0, v = y - y0;
  const auto column = static_cast<Index>(x0), row = static_cast<Index>(y0);
  double sum[4] = {};
  add_pixel(rgba, column, row, (1 - u) * (1 - v), sum);
  add_pixel(rgba, column + 1, row, u * (1 - v), sum);
  add_pixel(rgba, column, row + 1, (1 - u) * v, sum);
  add_pixel(rgba, column + 1, row + 1, u * v, sum);
  for (int k = 0; k < 3; ++k) out[k] = sum[3] > 0 ? static_cast<float>(std::min(1.0, sum[k] / sum[3])) : 0.0f;
  out[3] = static_cast<float>(std::min(1.0, sum[3]));
}
}  // namespace

std::string Lens::text() const {
  std::string text = model == LensModel::fisheye ? "fisheye " : "";
  text += "k1 " + short_number(k1) + " k2 " + short_number(k2) + " p1 " + short_number(p1) + " p2 " +
          short_number(p2);
  for (const auto& [name, value] : {std::pair{" k3 ", k3}, {" k4 ", k4}, {" k5 ", k5}, {" k6 ", k6}})
    if (value != 0) text += name + short_number(value);
  return text;
}

Vec2 Lens::distorted(const Vec2& point) const {
  const double x = point[0], y = point[1], r2 = x * x + y * y, a = radial(*this, r2).a;
  return {x * a + 2 * p1 * x * y + p2 * (r2 + 2 * x * x), y * a + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y};
}

bool Lens::is_regular(const Vec2& point) const {
  constexpr int kPlaces = 32;
  for (int i = 1; i <= kPlaces; ++i) {
    const double t = static_cast<double>(i) / kPlaces;
    const auto m = derivative(*this, {t * point[0], t * point[1]});
    // Tests both eigenvalues: a map that folds over twice has a positive determinant.
    if (!(determinant(m) > 0 && m[0] + m[2] > 0)) return false;
  }
  return true;
}

std::optional<Vec2> Lens::undistorted(const Vec2& seen) const {
  const auto off = [&](const Vec2& q) {
    const Vec2 p = distorted(q);
    return Vec2{p[0] - seen[0], p[1] - seen[1]};
  };
  const double enough = 1e-12 * (1 + std::hypot(seen[0], seen[1]));
  Vec2 q = seen, f = off(q);
  for (int step = 0; step < 100; ++step) {
    if (std::hypot(f[0], f[1]) <= enough) return is_regular(q) ? std::optional<Vec2>(q) : std::nullopt;
    const auto m = derivative(*this, q);
    const double d = determinant(m);
    if (!(std::abs(d) > 1e-300)) return std::nullopt;
    const Vec2 step_to = newton_step(m, f);
    Vec2 to = q;
    double scale = 1;
    for (int halving = 0; halving < 30; ++halving, scale /= 2) {
      to = {q[0] + scale * step_to[0], q[1] + scale * step_to[1]};
      const Vec2 g = off(to);
      if (std::hypot(g[0], g[1]) < std::hypot(f[0], f[1])) break;
    }
    q = to, f = off(q);
  }
  return std::nullopt;
}

Camera Intrinsics::camera(const Pose& pose, Index image_width, Index image_height) const {
  if (!(fl_x > 0) && !(angle_x > 0)) throw ValueError("[camera] intrinsics: fl_x or angle_x must be stated");
  const auto w = static_cast<double>(image_width), h = static_cast<double>(image_height);
  const bool sized = width > 0 && height > 0;
  const double sx = sized ? w / static_cast<double>(width) : 1,
               sy = sized ? h / static_cast<double>(height) : 1;
  if (sized && std::abs(sx - sy) > 1 / static_cast<double>(width) + 1 / static_cast<double>(height))
    throw ValueError("[camera] image: must be of " + std::to_string(width) + " x " + std::to_string(height) +
                     " pixels as stated, or that scaled, got " + std::to_string(image_width) + " x " +
                     std::to_string(image_height));
  Camera c = angle_x > 0 ? make_camera(pose, angle_x, image_width, image_height)
                         : Camera{.pose = pose, .width = image_width, .height = image_height};
  if (fl_x > 0) c.fx = fl_x * sx;
  if (fl_y > 0)
    c.fy = fl_y * sy;
  else if (angle_y > 0)
    c.fy = 0.5 * h / std::tan(0.5 * angle_y);
  else if (fl_x > 0)
    c.fy = fl_x * sy;
  c.cx = cx ? *cx * sx : 0.5 * w;
  c.cy = cy ? *cy * sy : 0.5 * h;
  return c;
}

Crop covered_part(const Camera& camera, const Lens& lens) {
  Crop r{.left = 0, .top = 0, .width = camera.width, .height = camera.height};
  if (lens.is_pinhole()) return r;
  // Corners of a fisheye may see 90 degrees from the axis or more, which no pinhole can.
  if (lens.model != LensModel::fisheye) check_invertible(camera, lens);
  while (r.width > 0 && r.height > 0) {
    int worst = 0;
    double most = 0;
    for (int side = 0; side < 4; ++side)
      if (const double share = missing_share(camera, lens, r, side); share > most) most = share, worst = side;
    if (most == 0) {
      check_inverse(camera, lens, r);
      return r;
    }
    if (worst == 0) ++r.left;
    if (worst == 2) ++r.top;
    (worst < 2 ? r.width : r.height) -= 1;
  }
  throw ValueError("[covered_part] lens: must leave a part of the image, got " + lens.text());
}

Camera cropped(const Camera& camera, const Crop& part) {
  if (part.left < 0 || part.top < 0 || part.width < 1 || part.height < 1 ||
      part.left + part.width > camera.width || part.top + part.height > camera.height)
    throw ValueError("[cropped] part must be within the image of " + std::to_string(camera.width) + " x " +
                     std::to_string(camera.height) + ", got " + std::to_string(part.width) + " x " +
                     std::to_string(part.height) + " at (" + std::to_string(part.left) + ", " +
                     std::to_string(part.top) + ")");
  Camera c = camera;
  c.cx -= static_cast<double>(part.left), c.cy -= static_cast<double>(part.top);
  c.width = part.width, c.height = part.height;
  return c;
}

Tensor<float> undistorted_image(const Tensor<float>& rgba, const Camera& camera, const Lens& lens,
                                const Crop& part) {
  if (rgba.shape != Shape{camera.height, camera.width, 4})
    throw ShapeError("[undistorted_image] rgba must be [height, width, 4] of the camera, " +
                     std::to_string(camera.height) + " x " + std::to_string(camera.width) + ", got shape " +
                     rgba.shape.str());
  cropped(camera, part);  // checks
  Tensor<float> out(Shape{part.height, part.width, 4});
  for (Index y = 0; y < part.height; ++y)
    for (Index x = 0; x < part.width; ++x) {
      const Vec2 q =
          on_plane(camera, static_cast<double>(part.left + x) + 0.5, static_cast<double>(part.top + y) + 0.5);
      sample(rgba, on_image(camera, lens.distorted(q)), out.data.data() + 4 * (y * part.width + x));
    }
  return out;
}

NearestPixels nearest_pixels(const Camera& seen, const Lens& lens, const Camera& pinhole) {
  NearestPixels found;
  found.pixels.reserve(at(pinhole.height * pinhole.width));
  PixelOffsets offsets;
  offsets.reserve(at(pinhole.height * pinhole.width));
  for (Index y = 0; y < pinhole.height; ++y)
    for (Index x = 0; x < pinhole.width; ++x) {
      const double px = static_cast<double>(x) + 0.5, py = static_cast<double>(y) + 0.5;
      const Vec2 q = on_plane(pinhole, px, py), p = on_image(seen, lens.distorted(q));
      // A NaN, beyond a pole, becomes 0 and has no inverse.
      const auto nearest = [](double v, Index side) {
        return v > 0 ? static_cast<Index>(std::min(v, static_cast<double>(side) - 0.5)) : 0;
      };
      const Index column = nearest(p[0], seen.width), row = nearest(p[1], seen.height);
      const Vec2 centre = on_plane(seen, static_cast<double>(column) + 0.5, static_cast<double>(row) + 0.5);
      const auto to = undistorted_near(lens, centre, q, 1e-6 / std::max(seen.fx, seen.fy));
      found.pixels.push_back(to ? static_cast<std::int32_t>(row * seen.width + column) : -1);
      const Vec2 place = on_image(pinhole, to.value_or(q));
      offsets.push_back({static_cast<float>(place[0] - px), static_cast<float>(place[1] - py)});
    }
  found.offsets = std::make_shared<const PixelOffsets>(std::move(offsets));
  return found;
}

}  // namespace fieldmark::nerf
