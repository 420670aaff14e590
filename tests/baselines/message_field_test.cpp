#include "message_field.h"
#include <fieldmark/engine/adam.h>
#include <fieldmark/engine/ops/loss.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/nerf/field_sampler.h>

#include <algorithm>
#include <cmath>

#include "nerf/small_field.h"
#include "support/catch.h"
#include "support/dense_by_loops.h"
#include "support/worst.h"

using namespace fieldmark;
using namespace fieldmark::baselines;

namespace {

constexpr float kMessage[] = {1, -1, 1};
constexpr std::int8_t kSigns[] = {1, -1, 1};

nerf::Camera camera(Index width = 9, Index height = 7) {
  return nerf::make_camera(nerf::look_at({2.2, -3.1, 1.7}, {0.1, 0.2, 0}, {0, 0, 1}), 0.9, width, height);
}

// A message field on small_field(), with its parameters.
struct Made {
  nerf::RadianceField base = small_field();
  ParamStore<float> store;
  MessageField field;
  explicit Made(MessagePlace place)
      : field(store, base, {.place = place, .bits = 3, .width = 8, .seed = 3}) {}
  void silence(const std::string& name, Index first) {  // zeroes weights from row `first` on
    const auto shape = store.entry(store.find(name + "/weight")).shape;
    auto values = store.values(store.find(name + "/weight"));
    std::fill(values.begin() + first * shape[1], values.end(), 0.f);
  }
  Tensor<float> image() {
    Tape<float> tape;
    const Var<float> y =
        field.image(tape, Params<float>(store, nullptr), base, camera(), tape.constant(kMessage, {1, 3}));
    return {y.shape(), std::vector<float>(y.value(), y.value() + y.shape().size())};
  }
};

double worst(const std::vector<float>& a, const std::vector<float>& b) {
  REQUIRE(a.size() == b.size());
  double most = 0;
  for (std::size_t i = 0; i < a.size(); ++i) raise_to(most, std::abs(static_cast<double>(a[i] - b[i])));
  return most;
}

ParamStore<double> in_double(const ParamStore<float>& store) {
  ParamStore<double> exact;
  for (const auto& e : store.entries()) exact.add(e.name, e.shape);
  std::copy(store.values().begin(), store.values().end(), exact.values().begin());
  return exact;
}

Row row(const std::vector<float>& all, std::size_t i, std::size_t columns) {
  return {all.begin() + static_cast<long>(i * columns), all.begin() + static_cast<long>((i + 1) * columns)};
}

void append(Row& to, const Row& from) { to.insert(to.end(), from.begin(), from.end()); }

// Renders the first ray that hits something by loops, with density and colours of its samples from
// `of_sample`.
template <class F>
Row by_loops(const nerf::RadianceField& base, Index* pixel, F of_sample) {
  std::vector<float> pixels;
  for (Index p = 0; p < 63; ++p)
    pixels.insert(pixels.end(), {static_cast<float>(p % 9), static_cast<float>(p / 9)});
  nerf::CubeRays rays;
  rays.resize(63);
  rays.set(base.space, 0, camera(), pixels);
  nerf::RaySamples s;
  nerf::FieldSampler().sample(base, rays.batch(base.space), {}, {.stop = 1e-3f}, s);
  *pixel = 0;
  while (s.ray_begin[static_cast<std::size_t>(*pixel) + 1] < 3) ++*pixel;
  Tape<float> tape;
  const Var<float> y = base.field.encode_directions(
      tape.constant(&rays.seen_from[3 * static_cast<std::size_t>(*pixel)], {1, 3}));
  const Row direction(y.value(), y.value() + y.shape().size());
  double light = 1;
  Row colour(3, 0);
  for (Index i = s.ray_begin[static_cast<std::size_t>(*pixel)];
       i < s.ray_begin[static_cast<std::size_t>(*pixel) + 1]; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const auto [sigma, rgb] =
        of_sample(row(s.density_features, k, 4), row(s.colour_features, k, 4), direction);
    const double weight = light * -std::expm1(-sigma * static_cast<double>(base.step()));
    for (std::size_t a = 0; a < 3; ++a) colour[a] += weight * rgb[a];
    light -= weight;
  }
  for (double& c : colour) c += light;  // white
  return colour;
}

Row colours(const ParamStore<double>& store, const std::string& before, Row x) {
  for (int k = 0; k < 3; ++k) x = layer(store, before + "colour/" + std::to_string(k), x, k < 2);
  for (double& v : x) v = 1 / (1 + std::exp(-v));
  return x;
}

}  // namespace

TEST_CASE("message_field: where no weight listens to the message, images are the base field's") {
  Made inputs(MessagePlace::inputs), density(MessagePlace::density);
  inputs.silence("mark/density/0", 4);
  inputs.silence("mark/colour/0", 4 + 4 + 16);
  density.silence("mark/geometry/2", 0);
  const Tensor<float> want =
      nerf::Renderer(inputs.base, {.finer = 1, .least_weight = 0}).render(camera()).rgb;
  CHECK(worst(inputs.image().data, want.data) < 1e-5);
  CHECK(worst(density.image().data, want.data) < 1e-5);
  CHECK(worst(Made(MessagePlace::inputs).image().data, want.data) > 1e-2);
  CHECK(worst(Made(MessagePlace::density).image().data, want.data) > 1e-2);
}

TEST_CASE("message_field: a ray by loops, the message beside the inputs") {
  Made made(MessagePlace::inputs);
  const auto store = in_double(made.store);
  const Row bits(std::begin(kMessage), std::end(kMessage));
  Index pixel = 0;
  const Row want = by_loops(made.base, &pixel, [&](Row x, const Row& colour, const Row& direction) {
    append(x, bits);
    Row z = layer(store, "mark/density/1", layer(store, "mark/density/0", x, true), false);
    const double sigma = std::exp(z[0]);
    for (const Row* part : {&colour, &direction, &bits}) append(z, *part);
    return std::pair(sigma, colours(store, "mark/", z));
  });
  const auto got = made.image();
  for (Index a = 0; a < 3; ++a)
    CHECK(got[3 * pixel + a] == Approx(want[static_cast<std::size_t>(a)]).margin(1e-4));
}

TEST_CASE("message_field: a ray by loops, the message in the density") {
  Made made(MessagePlace::density);
  const auto store = in_double(made.store), base = in_double(made.base.params);
  Index pixel = 0;
  const Row want = by_loops(made.base, &pixel, [&](const Row& x, const Row& colour, const Row& direction) {
    Row z = layer(base, "density/1", layer(base, "density/0", x, true), false);
    Row g{z[0] / 16};
    append(g, Row(std::begin(kMessage), std::end(kMessage)));
    for (int k = 0; k < 3; ++k) g = layer(store, "mark/geometry/" + std::to_string(k), g, k < 2);
    const double sigma = std::exp(z[0] + g[0]);
    append(z, colour);
    append(z, direction);
    return std::pair(sigma, colours(base, "", z));
  });
  const auto got = made.image();
  // Interpolation between 513 values: a kink of the network lies within a sixteenth.
  for (Index a = 0; a < 3; ++a)
    CHECK(got[3 * pixel + a] == Approx(want[static_cast<std::size_t>(a)]).margin(1e-3));
}

TEST_CASE("message_field: a step along the gradient changes the loss by its square") {
  for (const MessagePlace place : {MessagePlace::inputs, MessagePlace::density}) {
    Made made(place);
    std::vector<float> grads(static_cast<std::size_t>(made.store.size()));
    const Tensor<float> target = uniform<float>({63, 3}, 0, 1, 8);
    const auto loss = [&](float* to) {
      Tape<float> tape;
      const Var<float> l = mse_loss<float>(made.field.image(tape, Params<float>(made.store, to), made.base,
                                                            camera(), tape.constant(kMessage, {1, 3})),
                                           tape.constant(target));
      if (to) tape.backward(l);
      return static_cast<double>(l.value()[0]);
    };
    loss(grads.data());
    double square = 0;
    for (const float g : grads) square += static_cast<double>(g * g);
    CHECK(square > 1e-6);
    const double step = 2e-3 / std::sqrt(square);
    const auto moved = [&](double by) {
      for (std::size_t i = 0; i < grads.size(); ++i)
        made.store.values()[i] += static_cast<float>(by) * grads[i];
      return loss(nullptr);
    };
    const double up = moved(step), down = moved(-2 * step);
    CHECK((up - down) / (2 * step) == Approx(square).epsilon(0.02));
  }
}

TEST_CASE("message_field: in 40 steps it learns to look like the base field") {
  for (const MessagePlace place : {MessagePlace::inputs, MessagePlace::density}) {
    Made made(place);
    const Tensor<float> want = nerf::Renderer(made.base).render(camera()).rgb;
    Adam<float> adam(made.store.size(), {.lr = 0.01, .beta2 = 0.99, .eps = 1e-15, .zero_grads = true});
    std::vector<double> losses;
    for (int step = 0; step < 40; ++step) {
      Tape<float> tape;
      const Var<float> loss = mse_loss<float>(made.field.image(tape, Params<float>(made.store), made.base,
                                                               camera(), tape.constant(kMessage, {1, 3})),
                                              tape.constant(want.data.data(), {63, 3}));
      tape.backward(loss);
      losses.push_back(static_cast<double>(loss.value()[0]));
      adam.step(made.store.values(), made.store.grads());
    }
    CAPTURE(losses.front(), losses.back());
    CHECK(losses.back() < 0.3 * losses.front());
  }
}

TEST_CASE("message_field: rendered as recorded, with the same bits on one and two threads") {
  for (const MessagePlace place : {MessagePlace::inputs, MessagePlace::density}) {
    Made made(place);
    const auto render = [&](int count) {
      const ScopedThreads scope(count);
      return made.field.render(made.store, made.base, camera(40, 30), kSigns, {.finer = 1});
    };
    CHECK(render(1).data == render(2).data);
    CHECK(worst(made.field.render(made.store, made.base, camera(), kSigns, {.finer = 1}).data,
                made.image().data) < 1e-6);
  }
}

TEST_CASE("message_field: an mlp field takes a message in its density") {
  nerf::RadianceField base(small_mlp_options());
  base.cameras = small_field().cameras;
  ParamStore<float> store;
  const MessageField field(store, base, {.place = MessagePlace::density, .bits = 3, .width = 8});
  const std::int8_t other[] = {-1, 1, 1};
  const auto one = field.render(store, base, camera(), kSigns),
             two = field.render(store, base, camera(), other);
  CHECK(worst(one.data, two.data) > 1e-4);
  CHECK_THROWS_WITH(
      MessageField(store, base, {.bits = 3}),
      "[message_field] base must have a table for a message beside its inputs, got an mlp field");
}

TEST_CASE("message_field: errors") {
  ParamStore<float> store;
  CHECK_THROWS_WITH(MessageField(store, small_field(), {.bits = 0, .width = 1}),
                    "[message_field] bits must be at least 1 and width at least 2, got 0 and 1");
  Made made(MessagePlace::density);
  const std::int8_t few[] = {1, 1};
  CHECK_THROWS_WITH(made.field.render(made.store, made.base, camera(), few),
                    Contains("[message_field] message") && Contains("bits of the field"));
}
