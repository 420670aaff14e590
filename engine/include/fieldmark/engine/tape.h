#pragma once
#include <fieldmark/core/error.h>
#include <fieldmark/engine/arena.h>
#include <fieldmark/engine/shape.h>
#include <fieldmark/engine/tensor.h>

#include <algorithm>
#include <cstdint>
#include <new>
#include <span>
#include <type_traits>
#include <vector>

namespace fieldmark {

template <class T>
class Tape;

namespace detail {
// g[i] = or += seed[i], or 0 where mask (null: none) is not positive.
template <class T>
void seed_gradient(const T* seed, const T* mask, bool fresh, T* g, Index n);
}  // namespace detail

/// A matrix W [in, out] in the layout of matrix products: panels of columns of W and of W^T, optionally in
/// bf16 too. See PackedWeights.
template <class T>
struct PackedMatrix {
  const T* forward = nullptr;                      ///< panels of W
  const T* transposed = nullptr;                   ///< panels of W^T
  const std::uint16_t* forward_bf16 = nullptr;     ///< W rounded; or null
  const std::uint16_t* transposed_bf16 = nullptr;  ///< W^T rounded; or null
};

/// Handle to a value on a tape: two pointers, trivially copyable, valid until Tape::reset().
template <class T>
class Var {
 public:
  /// Extents of the value.
  const Shape& shape() const { return slot_->shape; }
  /// Row-major values, shape().size() of them.
  const T* value() const { return slot_->value; }
  /// The tape it was recorded on.
  Tape<T>& tape() const { return *tape_; }
  /// Whether it depends on a leaf, so that gradients reach it.
  bool needs_grad() const { return slot_->needs_grad; }
  /// The packed form of this matrix, or null.
  const PackedMatrix<T>* packed() const { return slot_->packed; }
  /// dL/d(this) accumulated so far; nullptr before the first gradient.
  const T* grad() const { return slot_->grad; }
  /// The buffer to which a backward adds, zeroed on the first call; nullptr if this input needs no gradient.
  T* grad_acc() const;
  /// As grad_acc(), but a new buffer stays uninitialised and *fresh is set: the caller then assigns every
  /// element instead of adding, which saves a pass over memory.
  /// @param masked  the caller writes 0 where a rectified() value is not positive
  T* grad_acc(bool* fresh, bool masked = false) const;
  /// True for the output of a ReLU (Tape::mark_rectified). Its gradient counts only where the value is
  /// positive: an op that reads the value anyway may mask its gradient, which saves the ReLU's backward a
  /// pass over memory.
  bool rectified() const { return slot_->rectified; }
  /// True if every gradient added so far was masked.
  bool grad_masked() const { return slot_->masked; }

 private:
  friend class Tape<T>;
  struct Slot {
    const T* value;
    T* grad;
    Shape shape;
    bool needs_grad;
    bool rectified;  // a ReLU's output
    bool masked;     // every gradient so far was masked
    T* target;       // buffer of the gradient; null: the arena's
    const PackedMatrix<T>* packed;
  };
  Var(Tape<T>* t, Slot* s) : tape_(t), slot_(s) {}
  Tape<T>* tape_;
  Slot* slot_;
};

/// Records operations in the order they run and replays their backwards in reverse. Creation order is a
/// topological order, so backward() is one loop. One Tape per thread; there is no global tape.
template <class T>
class Tape {
 public:
  Tape() = default;
  Tape(const Tape&) = delete;
  Tape& operator=(const Tape&) = delete;

  /// @{
  /// A value that needs no gradient. The data must outlive the pass.
  Var<T> constant(const Tensor<T>& t) { return make(t.data.data(), nullptr, t.shape, false); }
  Var<T> constant(const T* value, Shape shape) { return make(value, nullptr, shape, false); }
  /// @}
  /// @{
  /// A parameter or another input to differentiate in: its gradient is added to `grad`.
  Var<T> leaf(const T* value, T* grad, Shape shape) { return make(value, grad, shape, true); }
  Var<T> leaf(const Tensor<T>& t, Tensor<T>& grad) { return leaf(t.data.data(), grad.data.data(), t.shape); }
  /// @}
  /// As leaf(), but the gradient overwrites `grad`; `grad` keeps its content if no gradient arrives.
  Var<T> fresh_leaf(const T* value, T* grad, Shape shape) {
    const Var<T> v = make(value, nullptr, shape, true);
    v.slot_->target = grad;
    return v;
  }
  /// A matrix with its packed form. @param grad  null: a constant
  Var<T> matrix(const T* value, T* grad, Shape shape, const PackedMatrix<T>* packed) {
    return make(value, grad, shape, grad != nullptr, packed);
  }
  /// Output of an op; *data points at uninitialised values, which the op fills.
  Var<T> output(Shape shape, T** data, std::initializer_list<Var<T>> inputs) {
    *data = scratch(shape.size());
    return make(*data, nullptr, shape,
                std::any_of(inputs.begin(), inputs.end(), [](const Var<T>& v) { return v.needs_grad(); }));
  }
  /// Output of an op that takes any number of inputs.
  Var<T> output(Shape shape, T** data, bool needs_grad) {
    *data = scratch(shape.size());
    return make(*data, nullptr, shape, needs_grad);
  }
  /// Marks `out` as the output of a ReLU, see Var::rectified().
  void mark_rectified(Var<T> out) { out.slot_->rectified = true; }
  /// The same elements under another shape of equal size; gradients pass through unchanged.
  Var<T> reshape(Var<T> x, Shape shape);
  /// Uninitialised memory until reset(), for values that a backward reads.
  template <class U = T>
  U* scratch(Index n) {
    static_assert(std::is_trivially_destructible_v<U>);
    return static_cast<U*>(arena_.allocate(static_cast<std::size_t>(n) * sizeof(U)));
  }

  /// Registers `fn(const T* dout)`, called only if a gradient reached `out`.
  template <class F>
  void on_backward(Var<T> out, F fn) {
    static_assert(std::is_trivially_destructible_v<F> && std::is_trivially_copyable_v<F>,
                  "a backward lives in the arena: capture Var, Shape, scalars and raw pointers only");
    if (!out.needs_grad()) return;
    auto* f = new (arena_.allocate(sizeof(F))) F(fn);
    nodes_.push_back({out, f, [](void* p, const T* dout) { (*static_cast<F*>(p))(dout); }});
  }

  /// Seeds dL/dloss = 1 and replays. @throws ShapeError unless `loss` has exactly one element
  void backward(Var<T> loss) {
    if (loss.shape().size() != 1)
      throw ShapeError("[backward] loss must have one element, got shape " + loss.shape().str());
    const T one = 1;
    backward(loss, std::span<const T>(&one, 1));
  }
  /// Seeds dL/dout = seed (row-major, one for each element of out) and replays.
  /// @throws ShapeError if the sizes differ   @throws ValueError if no input of `out` needs a gradient
  void backward(Var<T> out, std::span<const T> seed) {
    if (static_cast<Index>(seed.size()) != out.shape().size())
      throw ShapeError("[backward] seed must have one element for each of out, whose shape is " +
                       out.shape().str() + ", got " + std::to_string(seed.size()));
    bool fresh = false;
    T* g = out.grad() ? out.grad_acc() : out.grad_acc(&fresh, true);
    if (!g) throw ValueError("[backward] nothing to differentiate: no input of this value needs a gradient");
    detail::seed_gradient(seed.data(), out.rectified() ? out.value() : nullptr, fresh, g, out.shape().size());
    replay();
  }
  /// Replays from the gradients that the caller wrote to Var::grad_acc(): several outputs can be seeded by
  /// hand.
  void replay() {
    for (auto n = nodes_.rbegin(); n != nodes_.rend(); ++n)
      if (const T* dout = n->out.grad()) n->run(n->closure, dout);
  }
  /// Forgets the recorded pass and keeps its memory for the next one; every Var of it becomes invalid.
  void reset() {
    nodes_.clear();
    arena_.reset();
  }
  /// The memory of values, gradients and closures, for counting.
  Arena& arena() { return arena_; }

 private:
  struct Node {
    Var<T> out;
    void* closure;
    void (*run)(void*, const T*);
  };
  Var<T> make(const T* value, T* grad, Shape shape, bool needs, const PackedMatrix<T>* packed = nullptr) {
    using Slot = typename Var<T>::Slot;
    return Var<T>(this, new (arena_.allocate(sizeof(Slot)))
                            Slot{value, grad, shape, needs, false, true, nullptr, packed});
  }
  Arena arena_;
  std::vector<Node> nodes_;
};

template <class T>
T* Var<T>::grad_acc() const {
  bool fresh = false;
  T* g = grad_acc(&fresh);
  if (fresh) std::fill_n(g, slot_->shape.size(), T(0));
  return g;
}

template <class T>
T* Var<T>::grad_acc(bool* fresh, bool masked) const {
  *fresh = false;
  if (!slot_->needs_grad) return nullptr;
  if (!slot_->grad) {
    slot_->grad = slot_->target ? slot_->target : tape_->scratch(slot_->shape.size());
    *fresh = true;
  }
  if (!masked) slot_->masked = false;
  return slot_->grad;
}

template <class T>
Var<T> Tape<T>::reshape(Var<T> x, Shape shape) {
  if (shape.size() != x.shape().size())
    throw ShapeError("[reshape] shape must have the " + std::to_string(x.shape().size()) +
                     " elements of x, got shape " + shape.str());
  Var<T> out = make(x.value(), nullptr, shape, x.needs_grad());
  const Index n = shape.size();
  on_backward(out, [x, n](const T* dy) {
    T* dx = x.grad_acc();
    for (Index i = 0; i < n; ++i) dx[i] += dy[i];
  });
  return out;
}

}  // namespace fieldmark
