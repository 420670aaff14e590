#include "regression/random_graph.h"

#include <fieldmark/engine/ops/activation.h>
#include <fieldmark/engine/ops/batched_matmul.h>
#include <fieldmark/engine/ops/cholesky.h>
#include <fieldmark/engine/ops/comparison.h>
#include <fieldmark/engine/ops/determinant.h>
#include <fieldmark/engine/ops/eigenvalues.h>
#include <fieldmark/engine/ops/gather.h>
#include <fieldmark/engine/ops/layer_norm.h>
#include <fieldmark/engine/ops/layout.h>
#include <fieldmark/engine/ops/linear_solve.h>
#include <fieldmark/engine/ops/loss.h>
#include <fieldmark/engine/ops/operators.h>
#include <fieldmark/engine/ops/reduce.h>
#include <fieldmark/engine/ops/reduce_axes.h>
#include <fieldmark/engine/ops/relu_family.h>
#include <fieldmark/engine/ops/rows.h>
#include <fieldmark/engine/ops/slice.h>
#include <fieldmark/engine/ops/softmax.h>

template <class T>
void RandomGraph<T>::add_functions(Table& t) {
  const auto one = [&t](const std::string& name, auto f, bool domain = false) {
    t[name] = [name, f, domain](RandomGraph& g) {
      const std::size_t x = domain ? g.positive(g.any()) : g.any();
      g.emit(name, {x}, {}, f(g.vars_[x]));
    };
  };
  one("negate", [](V v) { return -v; });
  one(
      "reciprocal", [](V v) { return reciprocal(v); }, true);
  one("abs", [](V v) { return abs(v); });
  one("square", [](V v) { return square(v); });
  one(
      "sqrt", [](V v) { return sqrt(v); }, true);
  one(
      "log", [](V v) { return log(v); }, true);
  one(
      "log1p", [](V v) { return log1p(v); }, true);
  one("expm1", [](V v) { return expm1(v); });
  one("sin", [](V v) { return sin(v); });
  one("cos", [](V v) { return cos(v); });
  one("exp", [](V v) { return exp(v); });
  one("tanh", [](V v) { return tanh(v); });
  one("sigmoid", [](V v) { return sigmoid(v); });
  one("softplus", [](V v) { return softplus(v); });
  one("relu", [](V v) { return relu(v); });
  one("silu", [](V v) { return silu(v); });
  one("gelu", [](V v) { return gelu(v); });
  one("normal_cdf", [](V v) { return normal_cdf(v); });
  one("truncated_exp", [](V v) { return truncated_exp(v); });
  one("detach", [](V v) { return detach(v); });
  one("sum_all", [](V v) { return sum(v); });
  one("mean_all", [](V v) { return mean(v); });
  t["scale"] = [](RandomGraph& g) { g.scaled(g.any(), g.number(-1.5, 1.5)); };
  t["affine"] = [](RandomGraph& g) {
    const std::size_t x = g.any();
    const double f = g.number(-1, 1), o = g.number(-1, 1);
    g.emit("affine", {x}, {{"factor", f}, {"offset", o}}, affine(g.vars_[x], f, o));
  };
  t["pow_number"] = [](RandomGraph& g) {
    const std::size_t x = g.positive(g.any());
    const double p = g.number(-2, 2);
    g.emit("pow_number", {x}, {{"p", p}}, pow(g.vars_[x], p));
  };
  t["div_number"] = [](RandomGraph& g) {
    const std::size_t x = g.any();
    const double d = g.number(1, 2);
    g.emit("div_number", {x}, {{"divisor", d}}, div(g.vars_[x], d));
  };
  t["clamp"] = [](RandomGraph& g) {
    const std::size_t x = g.any();
    g.emit("clamp", {x}, {{"low", -0.4}, {"high", 0.6}}, clamp(g.vars_[x], -0.4, 0.6));
  };
}

template <class T>
void RandomGraph<T>::add_binary(Table& t) {
  const auto two = [&t](const std::string& name, auto f, bool positive_a = false, bool positive_b = false) {
    t[name] = [=](RandomGraph& g) {
      const std::size_t any = g.any(), a = positive_a ? g.positive(any) : any;
      const std::size_t b = positive_b ? g.partner(a, 0.5, 2) : g.partner(a);
      g.emit(name, {a, b}, {}, f(g.vars_[a], g.vars_[b]));
    };
  };
  two("add", [](V a, V b) { return a + b; });
  two("sub", [](V a, V b) { return a - b; });
  two("mul", [](V a, V b) { return a * b; });
  two(
      "div", [](V a, V b) { return a / b; }, false, true);
  two(
      "pow", [](V a, V b) { return pow(a, b); }, true);
  two("minimum", [](V a, V b) { return minimum(a, b); });
  two("maximum", [](V a, V b) { return maximum(a, b); });
  const auto mask = [&t](const std::string& name, auto f) {
    t[name] = [name, f](RandomGraph& g) {
      const std::size_t a = g.any(), b = g.partner(a), c = g.partner(a);
      const std::size_t m = g.emit(name, {a, b}, {}, f(g.vars_[a], g.vars_[b]));
      g.emit("where", {m, a, c}, {}, where(g.vars_[m], g.vars_[a], g.vars_[c]));
    };
  };
  mask("greater", [](V a, V b) { return greater(a, b); });
  mask("less", [](V a, V b) { return less(a, b); });
  t["equal"] = [](RandomGraph& g) {  // what a ReLU left at 0
    const std::size_t a = g.any(), c = g.partner(a), zero = g.input({1}, 0, 0);
    const std::size_t r = g.emit("relu", {a}, {}, relu(g.vars_[a]));
    const std::size_t m = g.emit("equal", {r, zero}, {}, equal(g.vars_[r], g.vars_[zero]));
    g.emit("where", {m, c, r}, {}, where(g.vars_[m], g.vars_[c], g.vars_[r]));
  };
  // An operator with a number on either side. The four of two tensors are above.
  const auto number = [&t](const std::string& name, auto f) {
    t["operator" + name] = [name, f](RandomGraph& g) {
      const bool first = g.below(2) == 0;
      const std::size_t any = g.any(), x = name == "/" && first ? g.positive(any) : any;
      const T n = static_cast<T>(std::round(g.number(1, 3) * 64) / 64);
      g.emit("operator" + name, {x}, {{"number", n}, {"first", first}},
             first ? f(n, g.vars_[x]) : f(g.vars_[x], n));
    };
  };
  number("+", [](auto a, auto b) { return a + b; });
  number("-", [](auto a, auto b) { return a - b; });
  number("*", [](auto a, auto b) { return a * b; });
  number("/", [](auto a, auto b) { return a / b; });
}

template <class T>
void RandomGraph<T>::add_axes(Table& t) {
  const auto reduce = [&t](const std::string& name, auto f) {
    t[name] = [name, f](RandomGraph& g) {
      std::size_t x = g.any(1);
      if (name == "max") {  // no ties
        const std::size_t noise = g.input(g.vars_[x].shape());
        x = g.emit("add", {x, noise}, {}, g.vars_[x] + g.vars_[noise]);
      }
      const auto list = g.some_axes(x);
      const bool keep = g.below(2) == 0;
      g.emit(name, {x}, axes_json(list, keep),
             f(g.vars_[x], axes(list), keep ? fieldmark::KeepAxes::yes : fieldmark::KeepAxes::no));
    };
  };
  reduce("sum", [](V v, auto a, auto k) { return sum(v, a, k); });
  reduce("mean", [](V v, auto a, auto k) { return mean(v, a, k); });
  reduce("variance", [](V v, auto a, auto k) { return variance(v, a, k); });
  reduce("max", [](V v, auto a, auto k) { return max(v, a, k); });
  reduce("logsumexp", [](V v, auto a, auto k) { return logsumexp(v, a, k); });
  t["softmax"] = [](RandomGraph& g) {
    const std::size_t x = g.any(1);
    const int axis = g.axis_of(x);
    g.emit("softmax", {x}, {{"axis", axis}}, softmax(g.vars_[x], axis));
  };
  t["softmax_last"] = [](RandomGraph& g) {
    const std::size_t x = g.any(1);
    g.emit("softmax_last", {x}, {}, softmax(g.vars_[x]));
  };
  t["cumsum"] = [](RandomGraph& g) {
    const std::size_t x = g.any(1);
    const int axis = g.axis_of(x);
    g.emit("cumsum", {x}, {{"axis", axis}}, cumsum(g.vars_[x], axis));
  };
  t["gather"] = [](RandomGraph& g) {
    const std::size_t x = g.any(1);
    const int axis = g.axis_of(x);
    const auto index = g.index(3, static_cast<std::size_t>(g.vars_[x].shape()[axis]));
    g.emit("gather", {x}, {{"axis", axis}, {"index", list_of<std::int32_t>(index)}},
           gather(g.vars_[x], axis, index));
  };
  t["scatter_add"] = [](RandomGraph& g) {
    const std::size_t x = g.any(1);
    const int axis = g.axis_of(x);
    const auto index = g.index(static_cast<std::size_t>(g.vars_[x].shape()[axis]), 3);
    g.emit("scatter_add", {x}, {{"axis", axis}, {"index", list_of<std::int32_t>(index)}, {"extent", 3}},
           scatter_add(g.vars_[x], axis, index, 3));
  };
  t["gather_rows"] = [](RandomGraph& g) {
    const std::size_t x = g.rows();
    const auto index = g.index(4, static_cast<std::size_t>(g.vars_[x].shape()[0]));
    g.emit("gather_rows", {x}, {{"index", list_of<std::int32_t>(index)}}, gather_rows(g.vars_[x], index));
  };
  t["broadcast_rows"] = [](RandomGraph& g) {
    const std::size_t all = g.rows(), x = g.emit("slice", {all}, {{"axis", 0}, {"begin", 0}, {"count", 1}},
                                                 slice(g.vars_[all], 0, 0, 1));
    g.emit("broadcast_rows", {x}, {{"rows", 3}}, broadcast_rows(g.vars_[x], 3));
  };
}

template <class T>
void RandomGraph<T>::add_layout(Table& t) {
  t["reshape"] = [](RandomGraph& g) {
    const std::size_t x = g.any();
    const fieldmark::Shape s{g.vars_[x].shape().size(), 1};
    g.emit("reshape", {x}, {{"shape", extents(s)}}, reshape(g.vars_[x], s));
  };
  t["permute"] = [](RandomGraph& g) {
    const std::size_t x = g.any(2);
    std::vector<int> order;
    for (const auto k : fieldmark::permutation(g.vars_[x].shape().rank(), g.rng_, ++g.drawn_))
      order.push_back(static_cast<int>(k));
    g.emit("permute", {x}, {{"order", order}}, permute(g.vars_[x], std::span<const int>(order)));
  };
  t["transpose"] = [](RandomGraph& g) {
    const std::size_t x = g.any(2);
    g.emit("transpose", {x}, {}, transpose(g.vars_[x]));
  };
  t["broadcast_to"] = [](RandomGraph& g) {
    const std::size_t x = g.partner(g.any(2));
    std::vector<fieldmark::Index> to = extents(g.vars_[x].shape());
    for (auto& n : to)
      if (n == 1) n = 2;
    if (to.size() < 4) to.insert(to.begin(), 2);
    const fieldmark::Shape s{std::span<const fieldmark::Index>(to)};
    g.emit("broadcast_to", {x}, {{"shape", to}}, broadcast_to(g.vars_[x], s));
  };
  t["pad"] = [](RandomGraph& g) {
    const std::size_t x = g.any(1);
    const int axis = g.axis_of(x);
    g.emit("pad", {x}, {{"axis", axis}, {"before", 1}, {"after", 2}, {"value", 0.5}},
           pad(g.vars_[x], axis, 1, 2, 0.5));
  };
  t["slice"] = [](RandomGraph& g) {
    const std::size_t x = g.any(1);
    const int axis = g.axis_of(x);
    const fieldmark::Index n = g.vars_[x].shape()[axis], begin = n / 2, count = n - begin;
    g.emit("slice", {x}, {{"axis", axis}, {"begin", begin}, {"count", count}},
           slice(g.vars_[x], axis, begin, count));
  };
  t["concatenate"] = [](RandomGraph& g) {
    const std::size_t x = g.any(1), y = g.input(g.vars_[x].shape());
    const int axis = g.axis_of(x);
    g.emit("concatenate", {x, y, x}, {{"axis", axis}},
           fieldmark::concatenate({g.vars_[x], g.vars_[y], g.vars_[x]}, axis));
  };
  t["slice_last"] = [](RandomGraph& g) {
    const std::size_t x = g.any(1);
    const fieldmark::Index count = (g.vars_[x].shape()[-1] + 1) / 2;
    g.emit("slice_last", {x}, {{"count", count}}, slice(g.vars_[x], 0, count));
  };
  t["concatenate_last"] = [](RandomGraph& g) {
    const std::size_t x = g.any(1), y = g.input(g.vars_[x].shape());
    g.emit("concatenate_last", {x, y}, {}, fieldmark::concatenate({g.vars_[x], g.vars_[y]}));
  };
}

template <class T>
void RandomGraph<T>::add_losses(Table& t) {
  // Weights for some of the losses, none for the others.
  const auto loss = [&t](const std::string& name, auto f) {
    t[name] = [=](RandomGraph& g) {
      const std::size_t a = g.any(), b = g.input(g.vars_[a].shape());
      const auto w = g.below(2) == 0 ? g.numbers(g.vars_[a].shape().size(), 0, 1) : std::span<const T>();
      g.emit(name, {a, b}, {{"delta", 0.5}, {"weights", list_of(w)}}, f(g.vars_[a], g.vars_[b], w));
    };
  };
  loss("l1_loss", [](V a, V b, auto w) { return l1_loss(a, b, w); });
  loss("mse_loss", [](V a, V b, auto w) { return mse_loss(a, b, w); });
  loss("huber_loss", [](V a, V b, auto w) { return huber_loss(a, b, 0.5, w); });
  t["bce_with_logits"] = [](RandomGraph& g) {
    const std::size_t x = g.any();
    const fieldmark::Index n = g.vars_[x].shape().size();
    const auto targets = g.numbers(n, 0, 1), w = g.below(2) == 0 ? g.numbers(n, 0, 1) : std::span<const T>();
    g.emit("bce_with_logits", {x}, {{"targets", list_of(targets)}, {"weights", list_of(w)}},
           bce_with_logits(g.vars_[x], targets, w));
  };
  t["softmax_cross_entropy"] = [](RandomGraph& g) {
    const std::size_t x = g.rows();
    const fieldmark::Shape s = g.vars_[x].shape();
    auto& labels = g.index(fieldmark::at(s[0]), fieldmark::at(s[1]));
    if (s[0] > 1) labels[0] = -1;  // ignored
    const auto w = g.below(2) == 0 ? g.numbers(s[0], 0, 1) : std::span<const T>();
    g.emit("softmax_cross_entropy", {x}, {{"index", labels}, {"weights", list_of(w)}},
           softmax_cross_entropy(g.vars_[x], std::span<const std::int32_t>(labels), w));
  };
  t["weighted_mean"] = [](RandomGraph& g) {
    const std::size_t x = g.any();
    const auto w = g.numbers(g.vars_[x].shape().size(), 0, 1);
    g.emit("weighted_mean", {x}, {{"weights", list_of(w)}}, weighted_mean(g.vars_[x], w));
  };
}

template <class T>
void RandomGraph<T>::add_matrices(Table& t) {
  t["batched_matmul"] = [](RandomGraph& g) {
    const std::size_t a = g.any(2);
    const fieldmark::Index k = g.vars_[a].shape()[-1];
    const std::size_t b = g.below(2) == 0 ? g.input({k, 3}) : g.input({2, 1, k, 2});
    if (g.vars_[a].shape().rank() == 4 && g.vars_[b].shape().rank() == 4 && g.vars_[a].shape()[0] != 2)
      return;
    g.emit("batched_matmul", {a, b}, {}, batched_matmul(g.vars_[a], g.vars_[b]));
  };
  const auto square_op = [&t](const std::string& name, auto f) {
    t[name] = [name, f](RandomGraph& g) {
      const std::size_t a = g.matrices();
      g.emit(name, {a}, {}, f(g.vars_[a]));
    };
  };
  square_op("inverse", [](V a) { return inverse(a); });
  square_op("determinant", [](V a) { return determinant(a); });
  square_op("log_determinant", [](V a) { return log_determinant(a); });
  t["solve"] = [](RandomGraph& g) {
    const std::size_t a = g.matrices(), b = g.right_side(a);
    g.emit("solve", {a, b}, {}, solve(g.vars_[a], g.vars_[b]));
  };
  t["triangular_solve"] = [](RandomGraph& g) {
    const std::size_t a = g.matrices(), b = g.right_side(a);
    const bool upper = g.below(2) == 0, transposed = g.below(2) == 0;
    g.emit("triangular_solve", {a, b}, {{"upper", upper}, {"transposed", transposed}},
           triangular_solve(g.vars_[a], g.vars_[b], {.upper = upper, .transposed = transposed}));
  };
  t["cholesky"] = [](RandomGraph& g) {
    const std::size_t a = g.definite();
    g.emit("cholesky", {a}, {}, cholesky(g.vars_[a]));
  };
  t["symmetric_eigenvalues"] = [](RandomGraph& g) {
    const std::size_t a = g.definite();
    g.emit("symmetric_eigenvalues", {a}, {}, symmetric_eigenvalues(g.vars_[a]));
  };
}

template <class T>
const typename RandomGraph<T>::Table& RandomGraph<T>::table() {
  static const Table all = [] {
    Table t;
    add_functions(t);
    add_binary(t);
    add_axes(t);
    add_layout(t);
    add_losses(t);
    add_matrices(t);
    add_networks(t);
    add_images(t);
    add_norms(t);
    return t;
  }();
  return all;
}

template class RandomGraph<float>;
template class RandomGraph<double>;
