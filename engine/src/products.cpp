#include <fieldmark/engine/products.h>
#include <fieldmark/engine/values.h>

namespace fieldmark {
namespace {

// Makes one tensor per input, of its shape.
template <class T>
void check_directions(const std::string& product, const std::string& name, std::span<const Tensor<T>> inputs,
                      std::span<const Tensor<T>> directions) {
  if (directions.size() != inputs.size())
    throw ValueError("[" + product + "] " + name + "s must be as many as the inputs, " +
                     std::to_string(inputs.size()) + ", got " + std::to_string(directions.size()));
  for (std::size_t k = 0; k < inputs.size(); ++k)
    if (directions[k].shape != inputs[k].shape)
      throw ShapeError("[" + product + "] " + name + " " + std::to_string(k) +
                       " must have the shape of its input, " + inputs[k].shape.str() + ", got shape " +
                       directions[k].shape.str());
}

template <class T>
void check_own(const std::string& product, const Tape<T>& tape, const Tape<T>& of_value) {
  if (&tape != &of_value)
    throw ValueError("[" + product +
                     "] f must return a value of the tape that it is given, got one of another");
}

template <class T>
std::vector<Tensor<T>> zeros_like(std::span<const Tensor<T>> inputs) {
  std::vector<Tensor<T>> zeros;
  for (const Tensor<T>& t : inputs) zeros.emplace_back(t.shape);
  return zeros;
}

}  // namespace

template <class T>
Jvp<T> jvp(const std::type_identity_t<DualFunction<T>>& f, std::span<const Tensor<T>> inputs,
           std::span<const Tensor<T>> tangents) {
  check_directions("jvp", "tangent", inputs, tangents);
  Tape<T> tape;
  std::vector<Dual<T>> x;
  for (std::size_t k = 0; k < inputs.size(); ++k)
    x.emplace_back(tape.constant(inputs[k]), tape.constant(tangents[k]));
  const Dual<T> y = f(tape, x);
  check_own("jvp", tape, y.tape());
  return {to_tensor(y.value()), to_tensor(y.tangent())};
}

template <class T>
InputProducts<T> vjp(const std::type_identity_t<VarFunction<T>>& f, std::span<const Tensor<T>> inputs,
                     const Tensor<T>& cotangent) {
  auto products = zeros_like(inputs);
  Tape<T> tape;
  std::vector<Var<T>> x;
  for (std::size_t k = 0; k < inputs.size(); ++k) x.push_back(tape.leaf(inputs[k], products[k]));
  const Var<T> y = f(tape, x);
  check_own("vjp", tape, y.tape());
  if (cotangent.shape != y.shape())
    throw ShapeError("[vjp] cotangent must have the shape of f's value, " + y.shape().str() + ", got shape " +
                     cotangent.shape.str());
  InputProducts<T> result{to_tensor(y), {}};
  if (y.needs_grad()) tape.backward(y, cotangent.data);
  result.products = std::move(products);
  return result;
}

template <class T>
InputProducts<T> hvp(const std::type_identity_t<DualFunction<T>>& f, std::span<const Tensor<T>> inputs,
                     std::span<const Tensor<T>> directions) {
  check_directions("hvp", "direction", inputs, directions);
  auto products = zeros_like(inputs);
  Tape<T> tape;
  std::vector<Dual<T>> x;
  for (std::size_t k = 0; k < inputs.size(); ++k)
    x.emplace_back(tape.leaf(inputs[k], products[k]), tape.constant(directions[k]));
  const Dual<T> y = f(tape, x);
  check_own("hvp", tape, y.tape());
  if (y.shape().size() != 1)
    throw ShapeError("[hvp] f must return one element, got shape " + y.shape().str());
  InputProducts<T> result{to_tensor(y.value()), {}};
  // The tangent of a linear f does not depend on the inputs: its Hessian is 0.
  if (y.tangent().needs_grad()) tape.backward(y.tangent());
  result.products = std::move(products);
  return result;
}

#define FIELDMARK_PRODUCTS(T)                                                                             \
  template Jvp<T> jvp<T>(const DualFunction<T>&, std::span<const Tensor<T>>, std::span<const Tensor<T>>); \
  template InputProducts<T> vjp<T>(const VarFunction<T>&, std::span<const Tensor<T>>, const Tensor<T>&);  \
  template InputProducts<T> hvp<T>(const DualFunction<T>&, std::span<const Tensor<T>>,                    \
                                   std::span<const Tensor<T>>);
FIELDMARK_PRODUCTS(float)
FIELDMARK_PRODUCTS(double)
#undef FIELDMARK_PRODUCTS

}  // namespace fieldmark
