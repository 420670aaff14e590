#include "peer_work.h"

#include <fieldmark/engine/ops/dense.h>
#include <fieldmark/engine/parallel.h>

#include <algorithm>
#include <cmath>

namespace fieldmark::bench {
namespace {

constexpr float kNearKink = 1e-5f;  // sums have size 1 and rounding errors below 1e-6
constexpr Index kPeerChunk = 1024;  // samples

// Calls f(entry, index of its first number, count) for every parameter that a pass reads.
template <class F>
void each_parameter(const ParamStore<float>& store, F f) {
  for (const auto& entry : store.entries())
    if (entry.name.find("/running_") == std::string::npos)
      f(entry, static_cast<std::size_t>(entry.offset), static_cast<std::size_t>(entry.shape.size()));
}

void add_pass(SafetensorsFile& file, const std::string& prefix, ParamStore<float>& store,
              const PeerPass& pass) {
  file.add(prefix + "x", pass.x_shape, pass.x);
  file.add(prefix + "u", pass.y_shape, pass.u);
  file.add(prefix + "y", pass.y_shape, pass.y);
  file.add(prefix + "dx", pass.x_shape, pass.dx);
  add_gradients(file, prefix, store, store.grads());
}

}  // namespace

SafetensorsFile parameters_work(const std::string& network, const ParamStore<float>& store) {
  SafetensorsFile file;
  std::string names;
  const std::span<const float> values = store.values();
  each_parameter(store, [&](const auto& entry, std::size_t begin, std::size_t size) {
    file.add("value/" + entry.name, entry.shape, values.subspan(begin, size));
    names += (names.empty() ? "" : ",") + entry.name;
  });
  file.metadata = {{"network", network}, {"parameters", names}, {"draws", "0"}};
  return file;
}

void add_gradients(SafetensorsFile& file, const std::string& prefix, const ParamStore<float>& store,
                   std::span<const float> grads) {
  each_parameter(store, [&](const auto& entry, std::size_t begin, std::size_t size) {
    file.add(prefix + "grad/" + entry.name, entry.shape, grads.subspan(begin, size));
  });
}

SafetensorsFile peer_work(const std::string& network, ParamStore<float>& store, const PeerPass& pass) {
  SafetensorsFile file = parameters_work(network, store);
  add_pass(file, "", store, pass);
  return file;
}

void add_draw(SafetensorsFile& file, ParamStore<float>& store, const PeerPass& pass) {
  std::string& draws = file.metadata["draws"];
  add_pass(file, "draw" + draws + "/", store, pass);
  draws = std::to_string(std::stoi(draws) + 1);
}

void leave_out_kinks(const ParamStore<float>& store, Shape shape, std::span<const float> x,
                     std::span<float> u) {
  const Index samples = shape[0], width = shape[1];
  parallel_for(samples, kPeerChunk, [&](Index begin, Index end) {
    Tape<float> tape;
    const Params<float> params(store, nullptr);
    const Index n = end - begin;
    std::vector<float> h(x.begin() + begin * width, x.begin() + end * width);
    for (int layer = 0; 2 * layer < static_cast<int>(store.entries().size()); ++layer) {
      tape.reset();
      const Var<float> z = dense(tape.constant(h.data(), {n, width}), params.leaf(tape, {2 * layer}),
                                 params.leaf(tape, {2 * layer + 1}), Activation::none);
      for (Index i = 0; i < n * width; ++i) {
        const float sum = z.value()[i];
        if (std::abs(sum) < kNearKink) std::fill_n(u.begin() + (begin + i / width) * width, width, 0.f);
        h[static_cast<std::size_t>(i)] = std::max(sum, 0.f);
      }
    }
  });
}

}  // namespace fieldmark::bench
