#include <fieldmark/engine/adam.h>
#include <fieldmark/engine/values.h>

#include "models.h"
#include "paper_loop.h"
#include "peer_work.h"

namespace fieldmark::bench {
namespace {

constexpr int kCompared = 3;  // steps whose losses are compared: the second and third follow Adam updates

// Training steps: forward, backward, Adam.
template <class T, template <class> class Model>
struct Training {
  explicit Training(const auto& size) : model(size), adam(model.store) {}
  Var<T> backward() {
    tape.reset();
    model.store.zero_grad();
    const Var<T> loss = model.loss(tape, Params<T>(model.store));
    tape.backward(loss);
    return loss;
  }
  void step() {
    backward();
    adam.step(model.store.values(), model.store.grads());
  }
  // Compares the losses of the first steps, and the gradients of the first.
  void compare() {
    for (int i = 0; i < kCompared; ++i) {
      losses.push_back(item(backward()));
      if (i == 0) first_grads.assign(model.store.grads().begin(), model.store.grads().end());
      adam.step(model.store.values(), model.store.grads());
    }
  }
  Model<T> model;
  Adam<T> adam;
  Tape<T> tape;
  std::vector<T> losses, first_grads;
};

template <template <class> class Model>
double error_of(const auto& size) {
  Training<float, Model> f(size);
  Training<double, Model> d(size);
  std::ranges::copy(f.model.store.values(), d.model.store.values().begin());
  f.compare();
  d.compare();
  return std::max(relative_error(f.losses, d.losses), relative_error(f.first_grads, d.first_grads));
}

template <template <class> class Model>
EngineRow timed(const auto& size, const RowOptions& o) {
  Training<float, Model> training(size);
  EngineRow row = row_of(time_calls([&] { training.step(); }, o.runs, 0.1, o.between),
                         training.model.operations(), training.model.items());
  row.error = error_of<Model>(size);
  return row;
}

// The first steps of timed() for a peer to repeat.
template <template <class> class Model>
SafetensorsFile work(const char* network, const auto& size) {
  Training<float, Model> training(size);
  SafetensorsFile file = parameters_work(network, training.model.store);
  training.model.add_data(file);
  training.compare();
  add_gradients(file, "", training.model.store, training.first_grads);
  file.add("y", {kCompared}, training.losses);
  return file;
}

template <template <class> class Model>
RowSpec row(std::string name, std::string what, const char* network, const auto& size) {
  return {std::move(name), std::move(what),
          [size](const RowOptions& o) { return timed<Model>(scaled(size, o.scale), o); },
          [network, size](const RowOptions& o) { return work<Model>(network, scaled(size, o.scale)); }};
}

}  // namespace

std::vector<RowSpec> model_rows() {
  const TransformerSize small{.texts = 1, .letters = 24, .width = 32, .heads = 4},
      wide{.texts = 16, .letters = 64, .width = 128, .heads = 4};
  const AutoencoderSize discs{.images = 32, .side = 16, .channels = 8},
      large{.images = 32, .side = 64, .channels = 16};
  return {row<Transformer>("transformer_step",
                           "training step of a transformer's block of width 32, 1 text of 24 letters",
                           "transformer", small),
          row<Transformer>("transformer_wide_step", "the same of width 128, 16 texts of 64 letters",
                           "transformer", wide),
          row<Autoencoder>("autoencoder_step",
                           "training step of an autoencoder of 8 and 16 channels, 32 images of 16 x 16",
                           "autoencoder", discs),
          row<Autoencoder>("autoencoder_wide_step", "the same of 16 and 32 channels, 32 images of 64 x 64",
                           "autoencoder", large),
          row<PaperLoop>(
              "paper_step",
              "training step of the networks of preset paper, 8 images of 80 x 80, without distortions",
              "paper", PaperLoopSize{.images = 8, .side = 80, .bits = 16})};
}

}  // namespace fieldmark::bench
