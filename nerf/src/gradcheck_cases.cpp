#include <fieldmark/nerf/camera.h>
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

// Fixed numbers in (lo, hi) without a pattern.
Tensor<double> numbers(Shape shape, double lo, double hi, double phase) {
  Tensor<double> t(shape);
  for (Index i = 0; i < t.size(); ++i)
    t[i] = lo + (hi - lo) * (0.5 + 0.5 * std::sin(phase + 1.7 * static_cast<double>(i * i + i)));
  return t;
}

// Positions inside of the cells of all levels (2, 4 and 8 cells an axis): differences must not step over a
// face.
Tensor<double> inner_positions(Index n) {
  Tensor<double> x(Shape{n, 3});
  for (Index i = 0; i < x.size(); ++i) x[i] = (static_cast<double>(i * 5 % 8) + 0.35) / 8;
  return x;
}

void set_values(std::span<double> values, const Tensor<double>& to) {
  std::copy(to.data.begin(), to.data.end(), values.begin());
}

GradcheckReport check_rays() {
  Camera camera = make_camera(look_at({1.5, -3, 2}, {0.1, 0, 0.2}, {0, 0, 1}), 0.7, 40, 30);
  camera.fy *= 1.1;
  const auto p = camera.parameters();
  const std::vector<Tensor<double>> inputs{{Shape{16}, {p.begin(), p.end()}},
                                           {Shape{3, 2}, {0, 0, 12.25, 29, 39.5, -3}}};
  return gradcheck([](Tape<double>&, auto v) { return rays(v[0], v[1]); }, inputs);
}

GradcheckReport check_hash_encoding(HashEncoding<double>::Part part) {
  ParamStore<double> store;
  const HashEncoding<double> encoding(store, "hash", kEncoding, 1);
  set_values(store.values(), numbers({store.size()}, -1, 1, 2));
  const std::vector<Tensor<double>> in{inner_positions(5)};
  return gradcheck_module([&](auto&, const auto& params, auto v) { return encoding(params, v[0], part); },
                          store, in);
}

GradcheckReport check_spherical_harmonics() {
  const std::vector<Tensor<double>> in{numbers({6, 3}, -1, 1, 1)};
  return gradcheck([](Tape<double>&, auto v) { return spherical_harmonics(v[0]); }, in);
}

GradcheckReport check_frequency_encoding() {
  const std::vector<Tensor<double>> in{numbers({5, 3}, -1, 1, 1)};
  return gradcheck([](Tape<double>&, auto v) { return frequency_encoding(v[0], 4); }, in,
                   {.step = 0.3});  // the highest band turns by 8 pi a unit
}

GradcheckReport check_composite() {
  const std::vector<Index> ray_begin{0, 3, 3, 8};
  const std::vector<Tensor<double>> in{numbers({8}, 0, 4, 1), numbers({8, 3}, 0, 1, 2),
                                       numbers({8}, 0.05, 1, 3)};
  return gradcheck(
      [&](Tape<double>&, auto v) { return composite(v[0], v[1], v[2], std::span<const Index>(ray_begin)); },
      in);
}

GradcheckReport check_distortion_loss() {
  const std::vector<Index> ray_begin{0, 3, 3, 8};
  const auto delta = numbers({8}, 0.05, 1, 3);
  const std::vector<double> middle{0.1, 0.2, 1, 0, 0.5, 0.75, 2, 4};
  const std::vector<Tensor<double>> in{numbers({8}, 0, 4, 1)};
  return gradcheck(
      [&](Tape<double>&, auto v) { return distortion_loss<double>(v[0], delta.data, middle, ray_begin); },
      in);
}

GradcheckReport check_photometric_loss(double huber, double least) {
  const auto photograph = numbers({6, 4}, 0, 1, 2), background = numbers({6, 3}, 0, 1, 3);
  const std::vector<Tensor<double>> in{numbers({6, 4}, least, least + 1, 1)};
  return gradcheck(
      [&](Tape<double>&, auto v) {
        return photometric_loss<double>(v[0], photograph.data, background.data, {.huber = huber});
      },
      in);
}

GradcheckReport check_field(bool colour) {
  ParamStore<double> store;
  const Field<double> field(store, {.encoding = kEncoding, .width = 5, .geometry = 3}, 1);
  set_values(store.values(), numbers({store.size()}, 0.05, 0.3, 2));
  // Biases that hold every ReLU open: differences must not step over its kink.
  for (const char* name : {"density/0/bias", "colour/0/bias", "colour/1/bias"})
    for (double& v : store.values(store.find(name))) v = 3;
  const std::vector<Tensor<double>> in{inner_positions(3), numbers({3, 3}, -0.7, 0.7, 4)};
  return gradcheck_module(
      [&](auto&, const auto& params, auto v) {
        const auto out = field(params, v[0], v[1]);
        return colour ? out.rgb : out.sigma;
      },
      store, in);
}

GradcheckReport check_mlp_field(bool colour) {
  ParamStore<double> store;
  const Field<double> field(
      store,
      {.kind = FieldKind::mlp,
       .mlp = {.layers = 3, .width = 5, .skip = 1, .position_bands = 2, .direction_bands = 2}},
      1);
  set_values(store.values(), numbers({store.size()}, 0.02, 0.1, 2));
  // Biases that hold every ReLU open, as above.
  for (const char* name : {"density/0/bias", "density/1/bias", "density/2/bias", "colour/1/bias"})
    for (double& v : store.values(store.find(name))) v = 1;
  const std::vector<Tensor<double>> in{numbers({3, 3}, 0, 1, 3), numbers({3, 3}, -0.7, 0.7, 4)};
  return gradcheck_module(
      [&](auto&, const auto& params, auto v) {
        const auto out = field(params, v[0], v[1]);
        return colour ? out.rgb : out.sigma;
      },
      store, in, {.step = 0.3});  // the highest band turns by 4 pi a cube side
}

}  // namespace

std::vector<GradcheckCase> gradcheck_cases() {
  using Part = HashEncoding<double>::Part;
  return {
      {"composite", check_composite},
      {"distortion_loss", check_distortion_loss},
      {"field density", [] { return check_field(false); }},
      {"field colour", [] { return check_field(true); }},
      {"frequency_encoding", check_frequency_encoding},
      {"hash_encoding density", [] { return check_hash_encoding(Part::density); }},
      {"hash_encoding colour", [] { return check_hash_encoding(Part::colour); }},
      {"mlp_field density", [] { return check_mlp_field(false); }},
      {"mlp_field colour", [] { return check_mlp_field(true); }},
      {"photometric_loss square", [] { return check_photometric_loss(10, 0); }},
      {"photometric_loss huber", [] { return check_photometric_loss(0.01, 2); }},
      {"rays", check_rays},
      {"spherical_harmonics", check_spherical_harmonics},
  };
}

}  // namespace fieldmark::nerf
