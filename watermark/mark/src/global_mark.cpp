#include <fieldmark/engine/ops/activation.h>
#include <fieldmark/engine/ops/slice.h>
#include <fieldmark/engine/shape_checks.h>
#include <fieldmark/nerf/frequency_encoding.h>
#include <fieldmark/watermark/mark/global_mark.h>

#include <cstdint>
#include <string>

namespace fieldmark::watermark {
namespace {

GlobalMarkOptions checked(const GlobalMarkOptions& o) {
  if (o.bits < 1 || o.message_features < 0 || o.colour_features < 0 || o.width < 2)
    throw ValueError(
        "[global_mark] bits, message_features, colour_features and width must be at least 1, 0, 0 and 2, "
        "got " +
        std::to_string(o.bits) + ", " + std::to_string(o.message_features) + ", " +
        std::to_string(o.colour_features) + " and " + std::to_string(o.width));
  if (o.position_bands < 1 || o.position_bands > 20 || o.direction_bands < 1 || o.direction_bands > 20)
    throw ValueError("[global_mark] position_bands and direction_bands must be 1 to 20, got " +
                     std::to_string(o.position_bands) + " and " + std::to_string(o.direction_bands));
  return o;
}

// Makes a network of the given widths, with ReLU after all layers but the last, and there too on request.
template <class T>
std::vector<Dense<T>> network(ParamStore<T>& store, const std::string& name,
                              std::initializer_list<Index> widths, bool relu_at_end, std::uint64_t seed) {
  std::vector<Dense<T>> layers;
  for (const Index* w = widths.begin(); w + 1 != widths.end(); ++w) {
    const bool last = w + 2 == widths.end();
    layers.emplace_back(
        store, name + "/" + std::to_string(layers.size()),
        DenseOptions{.in = w[0],
                     .out = w[1],
                     .activation = last && !relu_at_end ? Activation::none : Activation::relu},
        seed + layers.size());
  }
  return layers;
}

template <class T>
Var<T> through(const std::vector<Dense<T>>& layers, const Params<T>& params, Var<T> x) {
  for (const Dense<T>& layer : layers) x = layer(params, x);
  return x;
}

}  // namespace

template <class T>
GlobalMark<T>::GlobalMark(ParamStore<T>& store, std::string_view name, const GlobalMarkOptions& options,
                          std::uint64_t seed)
    : options_(checked(options)) {
  const std::string prefix(name);
  const auto& o = options_;
  const Index position = 3 + 6 * o.position_bands, direction = 3 + 6 * o.direction_bands;
  if (o.colour_features > 0)
    encode_ = network(store, prefix + "/encode",
                      {position + (o.authors_code ? 0 : direction) + colour_inputs(), o.width, o.width,
                       o.width, o.colour_features},
                      false, seed + 10);
  if (o.message_features > 0)
    message_ = network(store, prefix + "/message", {o.bits, o.message_features, o.message_features}, true,
                       seed + 20);
  register_fusion(store, prefix + "/fuse", seed + 30);
}

template <class T>
void GlobalMark<T>::register_fusion(ParamStore<T>& store, const std::string& name, std::uint64_t seed) {
  const auto& o = options_;
  const Index again = o.authors_code ? o.bits + colour_inputs() : 0;
  const Index first = o.colour_features + (o.message_features > 0 ? o.message_features : o.bits) +
                      (o.authors_code ? 3 + 6 * o.direction_bands : 0) + colour_inputs() + again;
  const Index in[] = {first, o.width + again, o.width / 2}, out[] = {o.width, o.width / 2, 3};
  for (int k = 0; k < 3; ++k)
    fuse_.emplace_back(
        store, name + "/" + std::to_string(k),
        DenseOptions{.in = in[k], .out = out[k], .activation = k < 2 ? Activation::relu : Activation::none},
        seed + static_cast<std::uint64_t>(k));
}

template <class T>
typename GlobalMark<T>::Output GlobalMark<T>::with_features(const Params<T>& params, Var<T> x, Var<T> d,
                                                            Var<T> c, Var<T> message) const {
  check_rank("global_mark", "message", message.shape(), 2, "[messages, N_b]");
  check_extent("global_mark", "message", message.shape(), 1, options_.bits, "bits of the mark");
  const Index n = x.shape()[0], messages = message.shape()[0];
  check_extent("global_mark", "d", d.shape(), 0, n, "rows of x");
  check_extent("global_mark", "c", c.shape(), 0, n, "rows of x");
  if (messages < 1 || n % messages != 0)
    throw ShapeError("[global_mark] message must have as many rows as divide the " + std::to_string(n) +
                     " samples, got shape " + message.shape().str());
  const Var<T> of_direction = concatenate<T>({d, nerf::frequency_encoding(d, options_.direction_bands)});
  std::vector<Var<T>> inputs;  // of G, except c
  if (options_.colour_features > 0) {
    std::vector<Var<T>> of_place{x, nerf::frequency_encoding(x, options_.position_bands)};
    if (!options_.authors_code) of_place.push_back(of_direction);
    of_place.push_back(c);
    inputs.push_back(through(encode_, params, concatenate<T>(of_place)));
  }
  const std::optional<Var<T>> features = inputs.empty() ? std::nullopt : std::optional(inputs.front());
  inputs.push_back(through(message_, params, message));
  if (options_.authors_code) inputs.push_back(of_direction);
  return {.colour = fused(params, std::move(inputs), c, message), .features = features};
}

// Computes c_m = sigmoid(G(inputs, c)); in the authors' code M and c enter each hidden layer once more.
template <class T>
Var<T> GlobalMark<T>::fused(const Params<T>& params, std::vector<Var<T>> inputs, Var<T> c,
                            Var<T> message) const {
  inputs.push_back(c);
  for (std::size_t k = 0; k < fuse_.size(); ++k) {
    if (options_.authors_code && k < 2) inputs.insert(inputs.end(), {message, c});
    inputs = {fuse_[k](params, inputs, c.shape()[0])};
  }
  return sigmoid(inputs.front());
}

template class GlobalMark<float>;
template class GlobalMark<double>;

}  // namespace fieldmark::watermark
