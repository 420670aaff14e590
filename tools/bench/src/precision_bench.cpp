#include <fieldmark/core/number_text.h>
#include <fieldmark/core/worst.h>
#include <fieldmark/engine/isa.h>
#include <fieldmark/engine/ops/activation.h>
#include <fieldmark/engine/ops/conv2d.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/imaging/metrics.h>
#include <fieldmark/nerf/analytic_scene.h>
#include <fieldmark/nerf/evaluation.h>
#include <fieldmark/nerf/trainer.h>
#include <fieldmark/tools/bench/precision_bench.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <limits>

#include "mlp.h"

namespace fieldmark::bench {
namespace {

using Rows = std::vector<PrecisionRow>;

struct Work {
  std::string name, measure;
  double base = 0;  // seconds of the first variant
  void add(Rows& rows, const std::string& variant, double seconds, double error) {
    if (base == 0) base = seconds;
    rows.push_back({name, variant, seconds, base / seconds, error, measure});
  }
};

Index scaled(double n, const PrecisionBenchOptions& o, Index least) {
  return std::max(least, static_cast<Index>(n * o.scale));
}

// Root mean square difference relative to that of b.
template <class A, class B>
double rms_error(const A& a, const B& b) {
  double off = 0, size = 0;
  for (std::size_t i = 0; i < b.size(); ++i) {
    const double d = static_cast<double>(a[i]) - static_cast<double>(b[i]);
    off += d * d;
    size += static_cast<double>(b[i]) * static_cast<double>(b[i]);
  }
  return std::sqrt(off / size);
}

// Forward pass, dX and dW in one precision, all results concatenated.
template <class T>
double layers(Index samples, Precision precision, int runs, std::vector<double>& results) {
  Mlp<T> mlp(4, 64, samples, precision);
  mlp.keep = true;
  ShardedLoop<T> loop(kShards, mlp.store.size());
  const double seconds = time_calls([&] { in_chunks(mlp, loop); }, runs).seconds;
  results.assign(mlp.y.begin(), mlp.y.end());
  results.insert(results.end(), mlp.dx.begin(), mlp.dx.end());
  results.insert(results.end(), mlp.store.grads().begin(), mlp.store.grads().end());
  return seconds;
}

void add_layers(Rows& rows, const PrecisionBenchOptions& o) {
  Work work{"4 dense layers of 64, forward, dX and dW", "RMS error relative to double"};
  const Index samples = scaled(65536, o, kChunk);
  std::vector<double> exact, results;
  const double seconds = layers<double>(samples, Precision::fp32, o.runs, exact);
  work.add(rows, "fp64", seconds, 0);
  const double single = layers<float>(samples, Precision::fp32, o.runs, results);
  work.add(rows, "fp32", single, rms_error(results, exact));
  if (bf16_units() == Bf16Units::none) return;
  const double half = layers<float>(samples, Precision::bf16, o.runs, results);
  work.add(rows, "bf16, dW in fp32", half, rms_error(results, exact));
}

void add_exp(Rows& rows, const PrecisionBenchOptions& o) {
  Work work{"exp of numbers from -87 to 88", "maximum relative error against double"};
  const Index n = scaled(1 << 20, o, 1024);
  std::vector<float> x = numbers<float>(n, 1), y(x.size());
  for (float& v : x) v = 0.5f + 87.5f * v;
  const auto worst = [&](const float* got) {
    double error = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
      const double want = std::exp(static_cast<double>(x[i]));
      raise_to(error, std::abs(static_cast<double>(got[i]) - want) / want);
    }
    return error;
  };
  const double plain =
      time_calls(
          [&] {
            parallel_for(n, 1 << 15, [&](Index b, Index e) {
              for (auto i = static_cast<std::size_t>(b); i < static_cast<std::size_t>(e); ++i)
                y[i] = std::exp(x[i]);
            });
          },
          o.runs)
          .seconds;
  work.add(rows, "C library", plain, worst(y.data()));
  Tape<float> tape;
  const float* got = nullptr;
  const double ours = time_calls(
                          [&] {
                            tape.reset();
                            got = exp(tape.constant(x.data(), {n})).value();
                          },
                          o.runs)
                          .seconds;
  work.add(rows, "polynomial of degree 6", ours, worst(got));
}

// Values and all gradients of a convolution.
template <class T>
struct Convolution {
  explicit Convolution(Shape of) : shape(of), c(of[3]) {}
  void run(ConvMethod method) {
    tape.reset();
    const Var<T> out = conv2d(tape.fresh_leaf(x.data(), dx.data(), shape),
                              tape.fresh_leaf(w.data(), dw.data(), {3, 3, c, c}),
                              tape.constant(bias.data(), {c}), Activation::none, method);
    y = out.value();
    tape.backward(out, u);
  }
  std::vector<T> results() const {
    std::vector<T> all(y, y + shape.size());
    all.insert(all.end(), dx.begin(), dx.end());
    all.insert(all.end(), dw.begin(), dw.end());
    return all;
  }
  Shape shape;
  Index c;
  std::vector<T> x = numbers<T>(shape.size(), 1), w = numbers<T>(9 * c * c, 2),
                 u = numbers<T>(shape.size(), 3), bias = numbers<T>(c, 4), dx = x, dw = w;
  Tape<T> tape;
  const T* y = nullptr;
};

void add_convolution(Rows& rows, const PrecisionBenchOptions& o) {
  Work work{"convolution 3 x 3, 64 to 64, forward, dX and dW", "RMS error relative to double"};
  const Index side = scaled(128, o, 24);
  Convolution<float> timed({4, side, side, 64}), small({1, 24, 24, 64});
  Convolution<double> exact({1, 24, 24, 64});
  exact.run(ConvMethod::direct);
  for (const ConvMethod method : {ConvMethod::direct, ConvMethod::fastest}) {
    const double seconds = time_calls([&] { timed.run(method); }, o.runs).seconds;
    small.run(method);
    work.add(rows, method == ConvMethod::direct ? "direct" : "Winograd, F(4 x 4, 3 x 3)", seconds,
             rms_error(small.results(), exact.results()));
  }
}

std::string short_number(float x) {
  char text[32];
  std::snprintf(text, sizeof text, "%g", static_cast<double>(x));
  return text;
}

void add_rendering(Rows& rows, const nerf::RadianceField& field, const nerf::Dataset& test,
                   const PrecisionBenchOptions& o) {
  Work work{"a view of " + test.name, "dB, against all samples in float"};
  struct Variant {
    std::string name;
    nerf::RenderOptions options;
  };
  std::vector<Variant> variants{{"all samples", {.stop = 0, .least_weight = 0}},
                                {"transmittance threshold 1e-4", {.stop = 1e-4f, .least_weight = 1e-5f}},
                                {"default threshold, " + short_number(nerf::RenderOptions{}.stop), {}},
                                {"transmittance threshold 1e-2", {.stop = 1e-2f, .least_weight = 1e-3f}}};
  if (bf16_units() != Bf16Units::none)
    variants.push_back({"default threshold, networks and table in bf16", {.precision = Precision::bf16}});
  const nerf::Camera& camera = test.views.front().camera;
  nerf::Renderer reference(field, variants.front().options);
  const auto want = reference.render(camera);
  for (const Variant& v : variants) {
    nerf::Renderer renderer(field, v.options);
    nerf::Rendering view;
    const double seconds = time_calls([&] { view = renderer.render(camera); }, o.runs, 0).seconds;
    const bool first = &v == variants.data();
    work.add(rows, v.name, seconds,
             first ? std::numeric_limits<double>::infinity() : psnr(view.rgb, want.rgb));
  }
}

// Trains once per variant; the first variant's field is used for rendering.
void add_training(Rows& rows, const nerf::Dataset& train, const nerf::Dataset& test,
                  const PrecisionBenchOptions& o) {
  const Index steps = scaled(600, o, 20);
  Work work{std::to_string(steps) + " steps of training on " + train.name,
            "dB on " + std::to_string(test.views.size()) + " test views"};
  struct Variant {
    std::string name;
    nerf::TrainOptions options;
  };
  std::vector<Variant> variants{{"fp32, rays end at 1e-2: the default", {}},
                                {"fp32, rays end at 1e-4", {.stop = 1e-4f}}};
  if (bf16_units() != Bf16Units::none)
    variants.push_back({"networks in bf16, dW in fp32", {.precision = Precision::bf16}});
  std::unique_ptr<nerf::RadianceField> first;
  for (Variant& v : variants) {
    v.options.schedule = {.steps = steps};
    auto field = std::make_unique<nerf::RadianceField>(nerf::RadianceFieldOptions{});
    nerf::Trainer trainer(*field, train, v.options);
    const auto begin = std::chrono::steady_clock::now();
    while (!trainer.done()) trainer.step(0);
    const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - begin;
    nerf::Renderer renderer(*field);
    work.add(rows, v.name, seconds.count(), nerf::evaluate(renderer, test).psnr);
    if (!first) first = std::move(field);
  }
  add_rendering(rows, *first, test, o);
}

}  // namespace

std::vector<PrecisionRow> run_precision_bench(const PrecisionBenchOptions& options,
                                              const std::function<void(const std::string&)>& progress) {
  if (options.runs < 1 || !(options.scale > 0 && options.scale <= 1))
    throw ValueError("[precision_bench] runs must be at least 1 and scale in (0, 1], got " +
                     std::to_string(options.runs) + " and " + number_text(options.scale));
  if (!options.train != !options.test)
    throw ValueError("[precision_bench] train and test must both be given, or none");
  const auto begin = [&](const char* name) {
    if (progress) progress(name);
  };
  Rows rows;
  begin("layers");
  add_layers(rows, options);
  begin("exp");
  add_exp(rows, options);
  begin("convolution");
  add_convolution(rows, options);
  begin("rendering and training");
  if (options.train) {
    add_training(rows, *options.train, *options.test, options);
    return rows;
  }
  const nerf::SceneOptions scene{.size = scaled(200, options, 16), .views = scaled(50, options, 8)};
  add_training(rows, nerf::make_scene(scene), nerf::make_scene(scene, "test"), options);
  return rows;
}

}  // namespace fieldmark::bench
