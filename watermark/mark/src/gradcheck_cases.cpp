#include <fieldmark/watermark/mark/global_mark.h>
#include <fieldmark/watermark/mark/gradcheck_cases.h>
#include <fieldmark/watermark/mark/mark_network.h>
#include <fieldmark/watermark/mark/power_budget.h>
#include <fieldmark/watermark/mark/weighted_segments.h>

#include <cmath>
#include <string>
#include <string_view>
#include <utility>

namespace fieldmark::watermark {
namespace {

// Returns fixed, irregular numbers in (0, 1).
Tensor<double> numbers(Shape shape, double phase) {
  Tensor<double> t(shape);
  for (Index i = 0; i < t.size(); ++i)
    t[i] = 0.5 + 0.5 * std::sin(phase + 1.7 * static_cast<double>(i * i + i));
  return t;
}

// Makes every ReLU of a layer clearly active or inactive, in turns: differences must not step over its kink.
void open_and_shut(ParamStore<double>& store, const std::string& layer, double open) {
  const std::span<double> bias = store.values(store.find(layer + "/bias"));
  for (std::size_t i = 0; i < bias.size(); ++i) bias[i] = i % 2 == 0 ? open : -2 * open;
}

GradcheckReport check_mark_network() {
  ParamStore<double> store;
  const MarkNetwork<double> net(store, "mark", {.bands = 2, .features = 4, .tilt = 50, .shading = 0.9}, 3);
  open_and_shut(store, "mark/encode/0", 20);
  open_and_shut(store, "mark/encode/1", 4);
  open_and_shut(store, "mark/fuse/0", 2);
  for (const char* name : {"mark/encode/1/weight", "mark/fuse/0/weight"})  // keeps the tanh where it bends
    for (double& w : store.values(store.find(name))) w *= 0.02;
  const std::vector<Tensor<double>> in{numbers({3, 3}, 1), numbers({3, 3}, 2)};
  return gradcheck_module(
      [&](Tape<double>&, const Params<double>& params, auto v) { return net.carrier(params, v[0], v[1]); },
      store, in);
}

GradcheckReport check_global_mark(Index message_features, Index colour_features, bool authors_code,
                                  Index messages = 1) {
  ParamStore<double> store;
  const GlobalMark<double> net(store, "mark",
                               {.bits = 2,
                                .message_features = message_features,
                                .colour_features = colour_features,
                                .position_bands = 2,
                                .direction_bands = 1,
                                .width = 4,
                                .authors_code = authors_code},
                               3);
  // Gives layers with a ReLU weights so small that no weighted sum reaches the bias.
  const std::pair<const char*, double> layers[] = {
      {"encode/0", 0.05},  {"encode/1", 0.2}, {"encode/2", 0.15}, {"message/0", 0.2},
      {"message/1", 0.15}, {"fuse/0", 0.06},  {"fuse/1", 0.15}};
  for (const auto& [layer, weights] : layers) {
    if ((colour_features == 0 && std::string_view(layer).starts_with("encode")) ||
        (message_features == 0 && std::string_view(layer).starts_with("message")))
      continue;
    open_and_shut(store, std::string("mark/") + layer, 1);
    for (double& w : store.values(store.find(std::string("mark/") + layer + "/weight"))) w *= weights;
  }
  const Index n = 2 * messages;
  const std::vector<Tensor<double>> in{numbers({n, 3}, 1), numbers({n, 3}, 2),
                                       numbers({n, net.colour_inputs()}, 3), numbers({messages, 2}, 4)};
  return gradcheck_module([&](Tape<double>&, const Params<double>& params,
                              auto v) { return net(params, v[0], v[1], v[2], v[3]); },
                          store, in);
}

GradcheckReport check_power_budget() {
  const std::vector<double> mask{1, 0, 0.5, 2};
  const std::vector<Tensor<double>> in{numbers({4, 3}, 1)};
  return gradcheck(
      [&](Tape<double>&, auto v) { return power_budget(v[0], std::span<const double>(mask), 0.3); }, in);
}

GradcheckReport check_weighted_segments() {
  const std::vector<std::int32_t> begin{0, 2, 2, 3, 6};
  const std::vector<double> weights{0.5, -1, 2, 0, 0.25, 1};
  const std::vector<Tensor<double>> in{numbers({6, 2}, 1)};
  return gradcheck(
      [&](Tape<double>&, auto v) { return weighted_segments(v[0], begin, std::span<const double>(weights)); },
      in);
}

}  // namespace

std::vector<GradcheckCase> gradcheck_cases() {
  return {{"global_mark", [] { return check_global_mark(3, 3, false); }},
          {"global_mark, without MFF", [] { return check_global_mark(0, 3, false); }},
          {"global_mark, without CFF", [] { return check_global_mark(3, 0, false); }},
          {"global_mark, code", [] { return check_global_mark(3, 3, true); }},
          {"global_mark, code, with two messages", [] { return check_global_mark(3, 3, true, 2); }},
          {"mark_network", check_mark_network},
          {"power_budget", check_power_budget},
          {"weighted_segments", check_weighted_segments}};
}

}  // namespace fieldmark::watermark
