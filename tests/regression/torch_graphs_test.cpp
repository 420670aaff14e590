#include <fieldmark/engine/adam.h>
#include <fieldmark/engine/clip.h>
#include <fieldmark/engine/nn/dense.h>
#include <fieldmark/engine/ops/loss.h>
#include <fieldmark/engine/random.h>
#include <fieldmark/engine/safetensors.h>
#include <fieldmark/engine/sgd.h>
#include <fieldmark/engine/values.h>

#include <nlohmann/json.hpp>

#include <cstdlib>
#include <fstream>
#include <set>

#include "regression/random_graph.h"
#include "support/catch.h"
#include "support/source_dir.h"
#include "support/temporary_folder.h"
#include "support/torch.h"

// Another engine finds the same values, gradients and steps of optimisers.
using namespace fieldmark;

namespace {

constexpr int kGraphs = 200;

// Ten losses of an MLP [3, 16, 16, 2] on fixed data, with the description that torch_graphs.py repeats it by.
template <class Step>
nlohmann::json train_mlp(SafetensorsFile& file, const std::string& name, const Tensor<double>& x,
                         const Tensor<double>& target, nlohmann::json run, Step step) {
  ParamStore<double> store;
  const Dense<double> a(store, "a", {.in = 3, .out = 16, .activation = Activation::relu}, 1);
  const Dense<double> b(store, "b", {.in = 16, .out = 16, .activation = Activation::relu}, 2);
  const Dense<double> c(store, "c", {.in = 16, .out = 2}, 3);
  run["name"] = name;
  for (const auto& e : store.entries()) {
    file.add(name + "/" + e.name, e.shape, std::span<const double>(store.values(store.find(e.name))));
    run["parameters"].push_back(e.name);
  }
  auto optimise = step(store);
  const Params<double> params(store);
  Tape<double> tape;
  for (int i = 0; i < 10; ++i) {
    tape.reset();
    store.zero_grad();
    const auto loss = mse_loss(c(params, b(params, a(params, tape.constant(x)))), tape.constant(target));
    tape.backward(loss);
    run["losses"].push_back(item(loss));
    optimise();
  }
  return run;
}

nlohmann::json train_all(SafetensorsFile& file) {
  const auto x = uniform({64, 3}, -1, 1, 5), target = uniform({64, 2}, -1, 1, 6);
  file.add("x", x.shape, std::span<const double>(x.data));
  file.add("target", target.shape, std::span<const double>(target.data));
  const auto adam = [](AdamOptions o) {
    return [o](ParamStore<double>& store) {
      return [&store, adam = Adam<double>(store, o)]() mutable { adam.step(store.values(), store.grads()); };
    };
  };
  const auto sgd = [](SgdOptions o, double clip) {
    return [o, clip](ParamStore<double>& store) {
      return [&store, clip, sgd = Sgd<double>(store, o)]() mutable {
        if (clip > 0) clip_grad_norm(store, clip);
        sgd.step(store.values(), store.grads());
      };
    };
  };
  nlohmann::json all;
  all.push_back(
      train_mlp(file, "adam", x, target,
                {{"optimiser", "Adam"}, {"options", {{"lr", 0.01}, {"betas", {0.9, 0.999}}, {"eps", 1e-8}}}},
                adam({.lr = 0.01, .beta2 = 0.999, .eps = 1e-8})));
  all.push_back(
      train_mlp(file, "adamw", x, target,
                {{"optimiser", "AdamW"},
                 {"options", {{"lr", 0.01}, {"betas", {0.9, 0.999}}, {"eps", 1e-8}, {"weight_decay", 0.1}}}},
                adam({.lr = 0.01, .beta2 = 0.999, .eps = 1e-8, .weight_decay = 0.1})));
  all.push_back(
      train_mlp(file, "momentum", x, target,
                {{"optimiser", "SGD"}, {"options", {{"lr", 0.05}, {"momentum", 0.9}, {"weight_decay", 0.1}}}},
                sgd({.lr = 0.05, .momentum = 0.9, .weight_decay = 0.1}, 0)));
  all.push_back(train_mlp(file, "nesterov", x, target,
                          {{"optimiser", "SGD"},
                           {"options", {{"lr", 0.05}, {"momentum", 0.9}, {"nesterov", true}}},
                           {"clip", 0.1}},
                          sgd({.lr = 0.05, .momentum = 0.9, .nesterov = true}, 0.1)));
  return all;
}

}  // namespace

TEST_CASE("regression: random graphs use every op, and no value leaves the range of tanh and its like") {
  std::set<std::string> used;
  for (int g = 0; g < kGraphs; ++g) {
    Tape<double> tape;
    RandomGraph graph(tape, static_cast<std::uint64_t>(g));
    const Var<double> y = graph.build();
    for (const auto& step : graph.steps()) used.insert(step["op"]);
    for (Index i = 0; i < y.shape().size(); ++i) REQUIRE(std::isfinite(y.value()[i]));
  }
  for (const auto& op : RandomGraph::ops()) {
    CAPTURE(op);
    CHECK(used.count(op) == 1);
  }
}

TEST_CASE(
    "regression: PyTorch has the values and gradients of 200 random graphs to 1e-10, and ten steps of each "
    "optimiser to 1e-9") {
  if (!torch_or_skip("the comparison of random graphs with PyTorch")) return;
  const TemporaryFolder folder;
  SafetensorsFile file;
  nlohmann::json graphs;
  for (int g = 0; g < kGraphs; ++g) {
    Tape<double> tape;
    RandomGraph graph(tape, static_cast<std::uint64_t>(g));
    graph.save(file, std::to_string(g) + "/", graph.build());
    graphs.push_back(graph.steps());
  }
  file.metadata["graphs"] = graphs.dump();
  file.metadata["training"] = train_all(file).dump();
  file.write(folder / "graphs");
  const std::string command = "OMP_NUM_THREADS=1 /usr/bin/python3 " + source_dir() +
                              "/tests/regression/torch_graphs.py '" + (folder / "graphs").string() + "' > '" +
                              (folder / "answer").string() + "'";
  REQUIRE(std::system(command.c_str()) == 0);
  std::ifstream answer(folder / "answer");
  std::string name;
  double value = 1, gradient = 1;
  int compared = 0;
  for (; answer >> name >> value >> gradient; ++compared) {
    const double limit = name.starts_with("graph") ? 1e-10 : 1e-9;
    INFO(name << ": " << value << ", gradients " << gradient);
    CHECK(value <= limit);
    CHECK(gradient <= limit);
  }
  CHECK(compared == kGraphs + 4);
}
