#include <fieldmark/nerf/camera.h>
#include <fieldmark/nerf/colour_affine.h>
#include <fieldmark/nerf/composite.h>
#include <fieldmark/nerf/distortion_loss.h>
#include <fieldmark/nerf/field.h>
#include <fieldmark/nerf/frequency_encoding.h>
#include <fieldmark/nerf/gradcheck_cases.h>
#include <fieldmark/nerf/photometric_loss.h>
#include <fieldmark/nerf/rays.h>
#include <fieldmark/nerf/spherical_harmonics.h>

#include <algorithm>
#include <cmath>

namespace fieldmark::nerf {
namespace {

constexpr HashEncodingOptions kEncoding{
    .levels = 3, .features = 2, .log2_table = 6, .base_resolution = 2, .finest_resolution = 8};

// Returns irregular values in (lo, hi), the same in every run.
Tensor<double> scatter(Shape shape, double lo, double hi, double phase) {
  Tensor<double> t(shape);
  for (Index i = 0; i < t.size(); ++i)
    t[i] = lo + (hi - lo) * (0.5 + 0.5 * std::sin(phase + 1.7 * static_cast<double>(i * i + i)));
  return t;
}

// Returns positions inside the cells of all levels (2, 4 and 8 cells per axis): finite differences must not
// cross a face.
Tensor<double> inner_positions(Index n) {
  Tensor<double> x(Shape{n, 3});
  for (Index i = 0; i < x.size(); ++i) x[i] = (static_cast<double>(i * 5 % 8) + 0.35) / 8;
  return x;
}

void set_values(std::span<double> values, const Tensor<double>& to) {
  std::copy(to.data.begin(), to.data.end(), values.begin());
}

// Checks the gradients of an op, called as f(variables).
template <class F>
GradcheckReport check_op(F f, const std::vector<Tensor<double>>& inputs,
                         const GradcheckOptions& options = {}) {
  return gradcheck([&](Tape<double>&, auto v) { return f(v); }, inputs, options);
}

GradcheckReport check_rays_op() {
  Camera camera = make_camera(look_at({1.5, -3, 2}, {0.1, 0, 0.2}, {0, 0, 1}), 0.7, 40, 30);
  camera.fy *= 1.1;
  const auto p = camera.parameters();
  return check_op([](auto v) { return rays(v[0], v[1]); },
                  {{Shape{16}, {p.begin(), p.end()}}, {Shape{3, 2}, {0, 0, 12.25, 29, 39.5, -3}}});
}

GradcheckReport check_hash_encoding(HashEncoding<double>::Part part) {
  ParamStore<double> store;
  const HashEncoding<double> encoding(store, "hash", kEncoding, 1);
  set_values(store.values(), scatter({store.size()}, -1, 1, 2));
  const std::vector<Tensor<double>> in{inner_positions(5)};
  return gradcheck_module([&](auto&, const auto& params, auto v) { return encoding(params, v[0], part); },
                          store, in);
}

GradcheckReport check_colour_affine() {
  const std::vector<Index> image{1, 0, 1, 2, 1};
  return check_op([&](auto v) { return colour_affine(v[0], v[1], std::span<const Index>(image)); },
                  {scatter({5, 4}, 0, 1, 1), scatter({3, 12}, -0.5, 0.5, 2)});
}

GradcheckReport check_composite() {
  const std::vector<Index> ray_begin{0, 3, 3, 8};
  return check_op([&](auto v) { return composite(v[0], v[1], v[2], std::span<const Index>(ray_begin)); },
                  {scatter({8}, 0, 4, 1), scatter({8, 3}, 0, 1, 2), scatter({8}, 0.05, 1, 3)});
}

GradcheckReport check_distortion_loss() {
  const std::vector<Index> ray_begin{0, 3, 3, 8};
  const auto delta = scatter({8}, 0.05, 1, 3);
  const std::vector<double> middle{0.1, 0.2, 1, 0, 0.5, 0.75, 2, 4};
  return check_op([&](auto v) { return distortion_loss<double>(v[0], delta.data, middle, ray_begin); },
                  {scatter({8}, 0, 4, 1)});
}

GradcheckReport check_photometric_loss(double huber, double least) {
  const auto truth = scatter({6, 4}, 0, 1, 2), background = scatter({6, 3}, 0, 1, 3);
  return check_op(
      [&](auto v) { return photometric_loss<double>(v[0], truth.data, background.data, {.huber = huber}); },
      {scatter({6, 4}, least, least + 1, 1)});
}

// Checks a field with parameters in [0.02, high) and a bias that keeps every ReLU active: finite differences
// must not cross its kink.
GradcheckReport check_field(const FieldOptions& options, double high, double bias, const Tensor<double>& x,
                            bool colour, const GradcheckOptions& step = {}) {
  ParamStore<double> store;
  const Field<double> field(store, options, 1);
  set_values(store.values(), scatter({store.size()}, 0.02, high, 2));
  for (const auto& e : store.entries())
    if (e.name.ends_with("/bias"))
      for (double& v : store.values(store.find(e.name))) v = bias;
  const std::vector<Tensor<double>> in{x, scatter({3, 3}, -0.7, 0.7, 4)};
  return gradcheck_module(
      [&](auto&, const auto& params, auto v) {
        const auto out = field(params, v[0], v[1]);
        return colour ? out.rgb : out.sigma;
      },
      store, in, step);
}

GradcheckReport check_hash_field(bool colour) {
  return check_field({.encoding = kEncoding, .width = 5, .geometry = 3}, 0.3, 3, inner_positions(3), colour);
}

GradcheckReport check_mlp_field(bool colour) {
  return check_field({.kind = FieldKind::mlp,
                      .mlp = {.layers = 3, .width = 5, .skip = 1, .position_bands = 2, .direction_bands = 2}},
                     0.1, 1, scatter({3, 3}, 0, 1, 3), colour,
                     {.step = 0.3});  // the highest band turns by 4 pi per cube side
}

}  // namespace

std::vector<GradcheckCase> gradcheck_cases() {
  using Part = HashEncoding<double>::Part;
  return {
      {"colour_affine", check_colour_affine},
      {"composite", check_composite},
      {"distortion_loss", check_distortion_loss},
      {"field density", [] { return check_hash_field(false); }},
      {"field colour", [] { return check_hash_field(true); }},
      {"frequency_encoding",
       [] {
         return check_op([](auto v) { return frequency_encoding(v[0], 4); }, {scatter({5, 3}, -1, 1, 1)},
                         {.step = 0.3});  // the highest band turns by 8 pi per unit
       }},
      {"hash_encoding density", [] { return check_hash_encoding(Part::density); }},
      {"hash_encoding colour", [] { return check_hash_encoding(Part::colour); }},
      {"mlp_field density", [] { return check_mlp_field(false); }},
      {"mlp_field colour", [] { return check_mlp_field(true); }},
      {"photometric_loss square", [] { return check_photometric_loss(10, 0); }},
      {"photometric_loss huber", [] { return check_photometric_loss(0.01, 2); }},
      {"rays", check_rays_op},
      {"spherical_harmonics",
       [] {
         return check_op([](auto v) { return spherical_harmonics(v[0]); }, {scatter({6, 3}, -1, 1, 1)});
       }},
  };
}

}  // namespace fieldmark::nerf
