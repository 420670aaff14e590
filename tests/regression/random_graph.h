#pragma once
#include <fieldmark/engine/ops/batched_matmul.h>
#include <fieldmark/engine/ops/layout.h>
#include <fieldmark/engine/ops/operators.h>
#include <fieldmark/engine/ops/reduce_axes.h>
#include <fieldmark/engine/ops/slice.h>
#include <fieldmark/engine/random.h>
#include <fieldmark/engine/safetensors.h>

#include <nlohmann/json.hpp>

#include <deque>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "support/random.h"
#include "support/worst.h"

/// A random graph of the engine's ops, recorded on a tape and described in JSON for another program. Ops with
/// a narrow domain follow ops that map into it; growing numbers are scaled down.
template <class T>
class RandomGraph {
 public:
  using Json = nlohmann::json;

  RandomGraph(fieldmark::Tape<T>& tape, std::uint64_t seed) : tape_(tape), rng_(seed), seed_(seed) {}

  /// Records twelve random ops, and the mean of every value that none of them reads.
  fieldmark::Var<T> build() {
    input({2, 3, 4});
    input({3, 4});
    input({4});
    std::vector<std::string> names;
    for (const auto& [name, f] : table()) names.push_back(name);
    for (int i = 0; i < 12; ++i) {
      // The first op of each graph cycles through the table, so that no op is left out.
      const auto pick = i == 0 ? static_cast<std::size_t>(seed_) % names.size() : below(names.size());
      table().at(names[pick])(*this);
    }
    // Side by side, since a sum of means of both signs would cancel.
    std::vector<std::size_t> means;
    std::vector<V> parts;
    for (std::size_t i = 0, count = vars_.size(); i < count; ++i) {
      if (read_[i]) continue;
      const std::size_t m =
          emit("mean", {i}, axes_json(all_axes(i), false), mean(vars_[i], axes(all_axes(i))));
      means.push_back(emit("reshape", {m}, {{"shape", {1}}}, reshape(vars_[m], {1})));
      parts.push_back(vars_[means.back()]);
    }
    return vars_[emit("concatenate", means, {{"axis", 0}},
                      fieldmark::concatenate(std::span<const V>(parts), 0))];
  }
  const Json& steps() const { return steps_; }
  static std::vector<std::string> ops() {
    std::vector<std::string> names;
    for (const auto& [name, f] : table()) names.push_back(name);
    return names;
  }
  /// Runs the backward pass and adds inputs, cotangent, value and gradients to a file.
  void save(fieldmark::SafetensorsFile& file, const std::string& prefix, fieldmark::Var<T> y) {
    const auto u = uniform<T>(y.shape(), 0.5, 1.5, 7);
    tape_.backward(y, u.data);
    const auto add = [&](const std::string& name, const fieldmark::Shape& s, const T* p) {
      file.add(prefix + name, s, std::span<const T>(p, static_cast<std::size_t>(s.size())));
    };
    for (std::size_t i = 0; i < inputs_.size(); ++i) {
      add("in" + std::to_string(i), inputs_[i].shape, inputs_[i].data.data());
      add("d" + std::to_string(i), inputs_[i].shape, grads_[i].data.data());
    }
    add("u", y.shape(), u.data.data());
    add("y", y.shape(), y.value());
  }

 private:
  using V = fieldmark::Var<T>;
  using Table = std::map<std::string, std::function<void(RandomGraph&)>>;

  std::size_t below(std::size_t n) {
    return static_cast<std::size_t>(rng_.below(static_cast<fieldmark::Index>(n), ++drawn_));
  }
  double number(double lo, double hi) { return lo + (hi - lo) * rng_.uniform_double(++drawn_); }

  std::size_t input(const fieldmark::Shape& shape, double lo = -1, double hi = 1) {
    inputs_.push_back(uniform<T>(shape, lo, hi, static_cast<unsigned>(++drawn_)));
    return leaf();
  }
  // Makes the last of inputs_ a leaf.
  std::size_t leaf() {
    grads_.emplace_back(inputs_.back().shape);
    return emit("input", {}, {}, tape_.leaf(inputs_.back(), grads_.back()));
  }
  std::size_t emit(const std::string& op, const std::vector<std::size_t>& in, Json args, V v) {
    if (args.is_null()) args = Json::object();
    args["op"] = op;
    args["in"] = in;
    for (const std::size_t i : in) read_[i] = true;
    steps_.push_back(args);
    vars_.push_back(v);
    read_.push_back(false);
    double largest = 0;
    for (fieldmark::Index i = 0; i < v.shape().size(); ++i)
      raise_to(largest, std::abs(static_cast<double>(v.value()[i])));
    if (largest > 3) return scaled(vars_.size() - 1, std::round(1024 / largest) / 1024);
    return vars_.size() - 1;
  }
  std::size_t scaled(std::size_t i, double factor) {
    return emit("scale", {i}, {{"factor", factor}}, scale(vars_[i], factor));
  }
  // Returns a value with at least `rank` axes, none of them empty.
  std::size_t any(int rank = 0) {
    const std::size_t first = below(vars_.size());
    for (std::size_t k = 0; k < vars_.size(); ++k) {
      const std::size_t i = (first + k) % vars_.size();
      if (vars_[i].shape().rank() >= rank && vars_[i].shape().size() > 0) return i;
    }
    return input({2, 3, 4});
  }
  // Adds an input that broadcasts with a value: some extents 1, some leading axes missing.
  std::size_t partner(std::size_t i, double lo = -1, double hi = 1) {
    const fieldmark::Shape s = vars_[i].shape();
    std::vector<fieldmark::Index> extents;
    for (int k = static_cast<int>(below(static_cast<std::size_t>(s.rank()) + 1)); k < s.rank(); ++k)
      extents.push_back(below(3) == 0 ? 1 : s[k]);
    return input(fieldmark::Shape(std::span<const fieldmark::Index>(extents)), lo, hi);
  }
  // Returns x^2 + 0.3.
  std::size_t positive(std::size_t i) {
    const std::size_t s = emit("square", {i}, {}, square(vars_[i]));
    return emit("affine", {s}, {{"factor", 1.0}, {"offset", 0.3}}, affine(vars_[s], 1, 0.3));
  }
  // Returns square matrices from an input, with 1, 1.4, .. added to the diagonal.
  std::size_t matrices() {
    const auto n = static_cast<fieldmark::Index>(2 + below(3));
    const std::size_t x = below(2) == 0 ? input({n, n}, -0.3, 0.3) : input({2, n, n}, -0.3, 0.3);
    fieldmark::Tensor<T> d({n, n});
    for (fieldmark::Index k = 0; k < n; ++k) d[k * n + k] = 1 + T(0.4) * static_cast<T>(k);
    inputs_.push_back(d);
    const std::size_t diagonal = leaf();
    return emit("add", {x, diagonal}, {}, vars_[x] + vars_[diagonal]);
  }
  std::size_t right_side(std::size_t a) {
    const fieldmark::Shape s = vars_[a].shape();
    return s.rank() == 2 ? input({s[0], 2}) : input({s[0], s[1], 2});
  }
  // a a^T + 1/2 on the diagonal.
  std::size_t definite() {
    const std::size_t a = matrices();
    const fieldmark::Index n = vars_[a].shape()[-1];
    const std::size_t t = emit("transpose", {a}, {}, transpose(vars_[a]));
    const std::size_t p = emit("batched_matmul", {a, t}, {}, batched_matmul(vars_[a], vars_[t]));
    fieldmark::Tensor<T> d({n, n});
    for (fieldmark::Index k = 0; k < n; ++k) d[k * n + k] = 0.5;
    inputs_.push_back(d);
    const std::size_t half = leaf();
    return emit("add", {p, half}, {}, vars_[p] + vars_[half]);
  }
  // Weighs a normalised value: its plain mean does not depend on gamma, and the gradient would be noise.
  void weighed(std::size_t i) {
    const std::size_t w = input(vars_[i].shape());
    emit("mul", {i, w}, {}, vars_[i] * vars_[w]);
  }
  int axis_of(std::size_t i) {
    return static_cast<int>(below(static_cast<std::size_t>(vars_[i].shape().rank())));
  }
  std::vector<int> some_axes(std::size_t i) {
    std::vector<int> list;
    for (int k = 0; k < vars_[i].shape().rank(); ++k)
      if (below(2) == 0) list.push_back(k);
    if (list.empty()) list.push_back(axis_of(i));
    return list;
  }
  std::vector<int> all_axes(std::size_t i) const {
    std::vector<int> list;
    for (int k = 0; k < vars_[i].shape().rank(); ++k) list.push_back(k);
    return list;
  }
  static fieldmark::Axes axes(const std::vector<int>& list) {
    return fieldmark::Axes(std::span<const int>(list));
  }
  static Json axes_json(const std::vector<int>& list, bool keep) { return {{"axes", list}, {"keep", keep}}; }
  static std::vector<fieldmark::Index> extents(const fieldmark::Shape& s) {
    std::vector<fieldmark::Index> list;
    for (int k = 0; k < s.rank(); ++k) list.push_back(s[k]);
    return list;
  }
  // Returns any value as a matrix with its last axis.
  std::size_t rows() {
    const std::size_t x = any(1);
    const fieldmark::Shape s = vars_[x].shape(), matrix{s.size() / s[-1], s[-1]};
    return emit("reshape", {x}, {{"shape", extents(matrix)}}, reshape(vars_[x], matrix));
  }
  // Returns images of at least 4 x 4 pixels: some of the graph, or new ones of the given channels that depend
  // on it. Noise separates equal pixels, which max_pool could choose between.
  std::size_t images(fieldmark::Index channels = 4) {
    std::size_t x = vars_.size();
    for (std::size_t k = vars_.size(); k-- > 0 && x == vars_.size();) {
      const fieldmark::Shape s = vars_[k].shape();
      if (s.rank() == 4 && s.size() <= 1000 && s[1] >= 4 && s[2] >= 4 && s[3] == channels) x = k;
    }
    if (x == vars_.size() || below(2) == 0) {
      const std::size_t of = any();
      x = emit("mean", {of}, axes_json(all_axes(of), false), mean(vars_[of], axes(all_axes(of))));
    }
    const fieldmark::Shape s = vars_[x].shape(),
                           shape = s.rank() == 4 ? s : fieldmark::Shape{2, 8, 8, channels};
    // A product: a norm would take out a number added to all pixels, whose gradient is 0 and in float noise.
    const std::size_t factor = input(shape), noise = input(shape);
    const std::size_t y = emit("mul", {x, factor}, {}, vars_[x] * vars_[factor]);
    return emit("add", {y, noise}, {}, vars_[y] + vars_[noise]);
  }
  std::vector<std::int32_t>& index(std::size_t n, std::size_t extent) {
    indices_.emplace_back();
    for (std::size_t k = 0; k < n; ++k) indices_.back().push_back(static_cast<std::int32_t>(below(extent)));
    return indices_.back();
  }
  // Returns constants for an op that takes a span: multiples of 1/64, the same in float and double, above lo.
  std::span<const T> numbers(fieldmark::Index n, double lo, double hi) {
    numbers_.emplace_back();
    for (fieldmark::Index k = 0; k < n; ++k)
      numbers_.back().push_back(static_cast<T>(std::ceil(number(lo, hi) * 64) / 64));
    return numbers_.back();
  }
  template <class U>
  static std::vector<U> list_of(std::span<const U> list) {
    return {list.begin(), list.end()};
  }

  static const Table& table();
  static void add_functions(Table& t);
  static void add_binary(Table& t);
  static void add_axes(Table& t);
  static void add_layout(Table& t);
  static void add_losses(Table& t);
  static void add_matrices(Table& t);
  static void add_networks(Table& t);
  static void add_images(Table& t);
  static void add_norms(Table& t);

  fieldmark::Tape<T>& tape_;
  fieldmark::CounterRng rng_;
  std::uint64_t seed_;
  std::uint64_t drawn_ = 0;
  std::deque<fieldmark::Tensor<T>> inputs_, grads_;
  std::deque<std::vector<std::int32_t>> indices_;
  std::deque<std::vector<T>> numbers_;
  std::vector<V> vars_;
  std::vector<bool> read_;
  Json steps_ = Json::array();
};
