#include <fieldmark/engine/nn/dense.h>
#include <fieldmark/engine/ops/slice.h>
#include <fieldmark/engine/shape_checks.h>

#include <algorithm>
#include <memory>

#include "nn/initial.h"

namespace fieldmark {
namespace {

template <class T>
void check_parts(std::span<const Var<T>> parts, Index rows, Index in) {
  Index columns = 0, groups = rows;
  bool whole = false;  // a part has all rows
  for (const Var<T>& part : parts) {
    check_rank("dense", "parts", part.shape(), 2, "[N, .] or [R, .]");
    const Index n = part.shape()[0];
    whole = whole || n == rows;
    if (n != rows && (n < 1 || rows % n != 0 || (groups != rows && n != groups)))
      throw ShapeError("[dense] parts must have " + std::to_string(rows) +
                       " rows, or all the same divisor of it, got shape " + part.shape().str());
    if (n != rows) groups = n;
    columns += part.shape()[1];
  }
  if (!whole) throw ShapeError("[dense] parts must include one of " + std::to_string(rows) + " rows");
  if (columns != in)
    throw ShapeError("[dense] parts must have " + std::to_string(in) + " columns together, got " +
                     std::to_string(columns));
}

// Columns of x and the rows of W that multiply them.
template <class T>
class Factors {
 public:
  // At most `most` of each.
  Factors(Tape<T>& tape, std::size_t most)
      : x_(tape.template scratch<Var<T>>(static_cast<Index>(most))),
        w_(tape.template scratch<Var<T>>(static_cast<Index>(most))) {}
  void add(Var<T> columns, Var<T> rows) {
    std::construct_at(x_ + count_, columns);
    std::construct_at(w_ + count_++, rows);
  }
  std::span<const Var<T>> x() const { return {x_, count_}; }
  std::span<const Var<T>> w() const { return {w_, count_}; }

 private:
  Var<T>*x_, *w_;
  std::size_t count_ = 0;
};

template <class T>
Var<T> joined(std::span<const Var<T>> parts, int axis) {
  return parts.size() == 1 ? parts.front() : concatenate<T>(parts, axis);
}

// Applies dense() to R equal groups of rows of x, each with its own row of b [R, out].
template <class T>
Var<T> dense_of_groups(Var<T> x, Var<T> w, Var<T> b, Activation activation) {
  Tape<T>& tape = x.tape();
  const Index groups = b.shape()[0], out = b.shape()[1], rows = x.shape()[0] / groups, in = x.shape()[1];
  if (groups == 1) return dense(x, w, tape.reshape(b, {out}), activation);
  auto* y = tape.template scratch<Var<T>>(groups);
  for (Index g = 0; g < groups; ++g)
    std::construct_at(
        y + g, dense(tape.part(x, g * rows * in, {rows, in}), w, tape.part(b, g * out, {out}), activation));
  return concatenate(std::span<const Var<T>>(y, at(groups)), 0);
}

}  // namespace

template <class T>
Dense<T>::Dense(ParamStore<T>& store, std::string_view name, const DenseOptions& options, std::uint64_t seed)
    : options_(options) {
  if (options.in < 1 || options.out < 1)
    throw ValueError("[dense] in and out must be at least 1, got in " + std::to_string(options.in) +
                     " and out " + std::to_string(options.out));
  store.require_free(name, {"weight", "bias"});
  weight_ = store.add(std::string(name) + "/weight", {options.in, options.out}, ParamRole::matrix);
  if (options.bias) bias_ = store.add(std::string(name) + "/bias", {options.out});
  detail::he_uniform(store.values(weight_), options.in, seed);
}

template <class T>
Var<T> Dense<T>::operator()(const Params<T>& params, Var<T> x) const {
  return dense(x, params.leaf(x.tape(), weight_),
               detail::bias_or_zeros(x.tape(), params, bias_, options_.out), options_.activation);
}

template <class T>
Var<T> Dense<T>::operator()(const Params<T>& params, std::span<const Var<T>> parts, Index rows) const {
  check_parts(parts, rows, options_.in);
  Tape<T>& tape = parts.front().tape();
  const Index out = options_.out;
  if (std::ranges::all_of(parts, [&](const Var<T>& part) { return part.shape()[0] == rows; }))
    return (*this)(params, joined(parts, 1));
  const Var<T> w = params.leaf(tape, weight_);
  Factors<T> of_rows(tape, parts.size()), of_groups(tape, parts.size());
  Index first = 0;
  for (const Var<T>& part : parts) {
    const Index k = part.shape()[1];
    (part.shape()[0] == rows ? of_rows : of_groups).add(part, tape.part(w, first * out, {k, out}));
    first += k;
  }
  const Var<T> b = dense(joined<T>(of_groups.x(), 1), joined<T>(of_groups.w(), 0),
                         detail::bias_or_zeros(tape, params, bias_, out));
  return dense_of_groups(joined<T>(of_rows.x(), 1), joined<T>(of_rows.w(), 0), b, options_.activation);
}

template class Dense<float>;
template class Dense<double>;

}  // namespace fieldmark
