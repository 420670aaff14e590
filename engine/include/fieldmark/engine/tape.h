#pragma once
#include <fieldmark/core/error.h>
#include <fieldmark/engine/arena.h>
#include <fieldmark/engine/shape.h>
#include <fieldmark/engine/tensor.h>
#include <fieldmark/engine/var.h>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <new>
#include <source_location>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

namespace fieldmark {

namespace detail {
// g[i] = seed[i] if fresh, else g[i] += seed[i]. A fresh g becomes 0 where mask (null: none) is not positive.
template <class T>
void seed_gradient(const T* seed, const T* mask, bool fresh, T* g, Index n);
}  // namespace detail

/// Receives callbacks for what a tape records and replays. TapeInspector (inspect.h) uses them to show the
/// graph, times and the first NaN.
template <class T>
class TapeObserver {
 public:
  virtual ~TapeObserver() = default;
  /// Called when an op allocates its output. @param from  the function that called Tape::output()
  virtual void made(Var<T> out, std::span<const Var<T>> inputs, const std::source_location& from) = 0;
  /// Called when an op has filled its output and registers its backward.
  virtual void recorded(Var<T> out) = 0;
  /// Called when a value is named, see Tape::name().
  virtual void named(Var<T> v, std::string_view name) = 0;
  /// Called before the backward of the op that made `out`.
  virtual void before_backward(Var<T> out) = 0;
  /// Called after the backward of the op that made `out`.
  virtual void after_backward(Var<T> out) = 0;
  /// Called when the tape discards the pass.
  virtual void reset() = 0;
};

/// Records operations in the order they run and replays their backwards in reverse. Creation order is a
/// topological order, so backward() is one loop. Use one Tape per thread; there is no global tape.
template <class T>
class Tape {
 public:
  Tape() = default;
  Tape(const Tape&) = delete;
  Tape& operator=(const Tape&) = delete;

  /// @{
  /// Records a value that needs no gradient. The data must outlive the pass, so a temporary does not compile.
  /// @throws ShapeError unless the tensor has as many elements as its shape
  Var<T> constant(const Tensor<T>& t) { return constant(filled(t, "constant"), t.shape); }
  Var<T> constant(const Tensor<T>&& t) = delete;
  Var<T> constant(const T* value, const Shape& shape) { return make(value, nullptr, shape, false); }
  /// @}
  /// @{
  /// Records a parameter or another input to differentiate with respect to. Adds its gradient to `grad`.
  /// @throws ShapeError unless `grad` and the shape have as many elements as the tensor
  Var<T> leaf(const T* value, T* grad, const Shape& shape) { return make(value, grad, shape, true); }
  Var<T> leaf(const Tensor<T>& t, Tensor<T>& grad) {
    if (grad.size() != t.size())
      throw ShapeError("[leaf] grad must have the " + std::to_string(t.size()) + " elements of t, got " +
                       std::to_string(grad.size()));
    return leaf(filled(t, "leaf"), grad.data.data(), t.shape);
  }
  Var<T> leaf(const Tensor<T>&& t, Tensor<T>& grad) = delete;
  /// @}
  /// Like leaf(), but each backward pass overwrites `grad`. If no gradient arrives, `grad` is unchanged.
  Var<T> fresh_leaf(const T* value, T* grad, const Shape& shape) {
    const Var<T> v = make(value, nullptr, shape, true);
    v.slot_->target = grad;
    fresh_.push_back(v);
    return v;
  }
  /// @{
  /// Allocates the output of an op and points *data to its uninitialised values, which the op fills.
  /// @param from  names the op for an observer
  /// @throws ValueError if an input was recorded on another tape
  Var<T> output(const Shape& shape, T** data, std::initializer_list<Var<T>> inputs,
                std::source_location from = std::source_location::current()) {
    return output(shape, data, std::span(inputs.begin(), inputs.size()), from);
  }
  Var<T> output(const Shape& shape, T** data, std::span<const Var<T>> inputs,
                std::source_location from = std::source_location::current()) {
    bool needs_grad = false;
    for (const Var<T>& v : inputs) {
      check_own(v, "the input of an op");
      needs_grad = needs_grad || v.needs_grad();
    }
    *data = scratch(shape.size());
    const Var<T> out = make(*data, nullptr, shape, needs_grad);
    if (observer_) [[unlikely]]
      observer_->made(out, inputs, from);
    return out;
  }
  /// @}
  /// Makes the next backward pass compute dL/dv for Var::grad() even if v is the output of a layer with a
  /// ReLU. This costs such a layer a pass over its output. @return v
  /// @throws ValueError if a backward pass came before
  Var<T> keep_grad(Var<T> v) {
    if (v.slot_->rectified && v.slot_->grad)
      throw ValueError("[keep_grad] must be called before the backward that computes the gradient");
    v.slot_->rectified = false;
    return v;
  }
  /// Views the same elements under another shape of equal size. Gradients pass through unchanged.
  Var<T> reshape(Var<T> x, Shape shape);
  /// Views the elements of x from `begin` on under the given shape. Gradients pass through unchanged.
  /// @throws ShapeError if they do not lie within x
  Var<T> part(Var<T> x, Index begin, Shape shape);
  /// Allocates uninitialised memory, valid until reset(), for values that a backward reads.
  /// @throws ValueError if n is negative or its size in bytes overflows
  template <class U = T>
  U* scratch(Index n) {
    static_assert(std::is_trivially_destructible_v<U>);
    if (n < 0 || n > std::numeric_limits<Index>::max() / static_cast<Index>(sizeof(U))) [[unlikely]]
      throw ValueError("[tape] a buffer must have 0 elements or more and fit into memory, got " +
                       std::to_string(n));
    return static_cast<U*>(arena_.allocate(static_cast<std::size_t>(n) * sizeof(U)));
  }

  /// Registers `fn(const T* dout)`, which each backward pass calls once if a gradient reached `out`. fn must
  /// not change what it captured, because a second backward pass calls it again.
  template <class F>
  void on_backward(Var<T> out, F fn) {
    static_assert(std::is_trivially_destructible_v<F> && std::is_trivially_copyable_v<F>,
                  "a backward lives in the arena: capture Var, Shape, scalars and raw pointers only");
    static_assert(alignof(F) <= Arena::kSmallAlign);
    check_own(out, "the output of an op");
    if (observer_) [[unlikely]]
      observer_->recorded(out);
    if (!out.needs_grad()) return;
    struct Closure : Node {
      F fn;
    };
    const auto run = [](const Node* n, const T* dout) { static_cast<const Closure*>(n)->fn(dout); };
    last_ = new (arena_.allocate_small(sizeof(Closure))) Closure{{last_, out, run}, fn};
  }

  /// Seeds dL/dloss = 1 and replays. Gradients of leaves accumulate over calls; those of all other values
  /// restart with each call. @throws ShapeError unless `loss` has exactly one element
  void backward(Var<T> loss) {
    if (loss.shape().size() != 1)
      throw ShapeError("[backward] loss must have one element, got shape " + loss.shape().str());
    const T one = 1;
    backward(loss, std::span<const T>(&one, 1));
  }
  /// Seeds dL/dout = seed (row-major, one for each element of out) and replays.
  /// @throws ShapeError if the sizes differ   @throws ValueError if no input of `out` needs a gradient, or it
  /// was recorded on another tape
  void backward(Var<T> out, std::span<const T> seed) {
    check_seed(out, seed);
    bool fresh = false;
    begin_pass();
    T* g = out.grad_buffer(&fresh, out.slot_->grad == nullptr);
    if (!g) throw_nothing_to_differentiate();
    const T* mask = fresh && out.slot_->rectified ? out.value() : nullptr;
    detail::seed_gradient(seed.data(), mask, fresh, g, out.shape().size());
    replay();
  }
  /// @{
  /// Like backward(out, seed), but reads the seed in place rather than copying it, which saves two passes
  /// over memory. The seed must live until the next backward pass or reset(), for Var::grad() shows it; a
  /// temporary vector does not compile. It is copied after all for leaves, for the output of a layer with a
  /// ReLU, where an earlier pass has given `out` a buffer, and when another gradient is added to it.
  void backward_in_place(Var<T> out, std::span<const T> seed) {
    check_seed(out, seed);
    begin_pass();
    auto& slot = *out.slot_;
    if (!slot.needs_grad || slot.grad || slot.target || slot.rectified || seed.empty())
      return backward(out, seed);
    slot.grad = const_cast<T*>(seed.data());  // grad_buffer() copies it before a write
    slot.masked = false;
    slot.borrowed = true;
    replay();
  }
  void backward_in_place(Var<T> out, const std::vector<T>&& seed) = delete;
  /// @}
  /// Replays from the gradients that the caller wrote to Var::grad_acc(), so that several outputs can be
  /// seeded by hand.
  void replay() {
    begin_pass();
    const Replaying replaying(phase_);
    if (observer_) [[unlikely]]
      return replay_observed();
    for (const Node* n = last_; n; n = n->before)
      if (const T* dout = n->out.slot_->grad) n->run(n, dout);
  }
  /// Discards the recorded pass and keeps its memory for the next one. Invalidates every Var of the pass.
  void reset() {
    last_ = nullptr;
    fresh_.clear();
    phase_ = Phase::recording;
    arena_.reset();
    if (observer_) [[unlikely]]
      observer_->reset();
  }
  /// Names a value for the observer; does nothing without one. @return v
  Var<T> name(Var<T> v, std::string_view name) {
    if (observer_) [[unlikely]]
      observer_->named(v, name);
    return v;
  }
  /// Sets the observer of this tape; null removes it. It must outlive the passes that it observes.
  void observe(TapeObserver<T>* observer) { observer_ = observer; }
  /// Returns the observer, or null.
  TapeObserver<T>* observer() const { return observer_; }
  /// Returns the arena that holds values, gradients and closures, for memory statistics.
  Arena& arena() { return arena_; }

 private:
  friend class Var<T>;
  friend struct detail::Shortcuts<T>;
  enum class Phase : std::uint8_t { recording, replaying, replayed };
  // Ends with `replayed` even if a backward throws: nothing may be added to half-finished gradients.
  struct Replaying {
    explicit Replaying(Phase& p) : phase(p) { phase = Phase::replaying; }
    Replaying(const Replaying&) = delete;
    Replaying& operator=(const Replaying&) = delete;
    ~Replaying() { phase = Phase::replayed; }
    Phase& phase;
  };
  // A recorded backward; the captures of its function follow it in memory.
  struct Node {
    const Node* before;  // recorded before this one, or null
    Var<T> out;
    void (*run)(const Node*, const T* dout);
  };
  // After a replay, restarts the gradients of all values but leaves, in their existing buffers.
  void begin_pass() {
    if (phase_ != Phase::replayed) return;
    phase_ = Phase::recording;
    for (const Node* n = last_; n; n = n->before) forget_gradient(*n->out.slot_);
    for (const Var<T>& v : fresh_) forget_gradient(*v.slot_);
  }
  void replay_observed() {
    for (const Node* n = last_; n; n = n->before) {
      const T* dout = n->out.slot_->grad;
      if (!dout) continue;
      observer_->before_backward(n->out);
      n->run(n, dout);
      observer_->after_backward(n->out);
    }
  }
  static void forget_gradient(typename Var<T>::Slot& slot) {
    if (slot.grad && !slot.borrowed) slot.target = slot.grad;
    slot.grad = nullptr;
    slot.masked = true;
    slot.borrowed = false;
  }
  void check_own(const Var<T>& v, const char* what) const {
    if (&v.tape() != this) [[unlikely]]
      throw ValueError(std::string("[tape] ") + what +
                       " was recorded on another tape: record all that belongs together on one");
  }
  void check_seed(const Var<T>& out, std::span<const T> seed) const {
    check_own(out, "the value to differentiate");
    if (static_cast<Index>(seed.size()) != out.shape().size())
      throw ShapeError("[backward] seed must have one element for each of out, whose shape is " +
                       out.shape().str() + ", got " + std::to_string(seed.size()));
  }
  [[noreturn]] static void throw_nothing_to_differentiate() {
    throw ValueError("[backward] nothing to differentiate: no input of this value needs a gradient");
  }
  static const T* filled(const Tensor<T>& t, const char* where) {
    if (t.size() != t.shape.size())
      throw ShapeError("[" + std::string(where) + "] t must have the elements of its shape " + t.shape.str() +
                       ", got " + std::to_string(t.size()));
    return t.data.data();
  }
  Var<T> make(const T* value, T* grad, const Shape& shape, bool needs,
              const PackedMatrix<T>* packed = nullptr) {
    using Slot = typename Var<T>::Slot;
    return Var<T>(new (arena_.allocate_small(sizeof(Slot)))
                      Slot{value, grad, shape, needs, false, true, false, nullptr, packed, this});
  }
  Arena arena_;
  const Node* last_ = nullptr;  // recorded last
  std::vector<Var<T>> fresh_;
  Phase phase_ = Phase::recording;
  TapeObserver<T>* observer_ = nullptr;
};

template <class T>
T* Var<T>::grad_acc() const {
  bool fresh = false;
  T* g = grad_acc(&fresh);
  if (fresh) std::fill_n(g, slot_->shape.size(), T(0));
  return g;
}

template <class T>
T* Var<T>::grad_acc(bool* fresh) const {
  return grad_buffer(fresh, false);
}

template <class T>
T* Var<T>::grad_buffer(bool* fresh, bool masked) const {
  *fresh = false;
  if (!slot_->needs_grad) return nullptr;
  tape().begin_pass();
  if (!slot_->grad) {
    slot_->grad = slot_->target ? slot_->target : tape().scratch(slot_->shape.size());
    *fresh = true;
  } else if (slot_->borrowed) [[unlikely]] {
    copy_borrowed_gradient();
  }
  if (!masked) slot_->masked = false;
  return slot_->grad;
}

template <class T>
void Var<T>::copy_borrowed_gradient() const {
  const Index n = slot_->shape.size();
  slot_->grad = std::copy_n(slot_->grad, n, tape().scratch(n)) - n;
  slot_->borrowed = false;
}

template <class T>
Var<T> Tape<T>::reshape(Var<T> x, Shape shape) {
  if (shape.size() != x.shape().size())
    throw ShapeError("[reshape] shape must have the " + std::to_string(x.shape().size()) +
                     " elements of x, got shape " + shape.str());
  return part(x, 0, shape);
}

template <class T>
Var<T> Tape<T>::part(Var<T> x, Index begin, Shape shape) {
  const Index n = shape.size();
  if (begin < 0 || n > x.shape().size() - begin)
    throw ShapeError("[part] elements " + std::to_string(begin) + " to " + std::to_string(begin + n) +
                     " must lie within x, got shape " + x.shape().str());
  check_own(x, "the input of an op");
  Var<T> out = make(x.value() + begin, nullptr, shape, x.needs_grad());
  if (observer_) [[unlikely]]
    observer_->made(out, std::span(&x, 1), std::source_location::current());
  on_backward(out, [x, begin, n](const T* dy) {
    T* dx = x.grad_acc() + begin;
    for (Index i = 0; i < n; ++i) dx[i] += dy[i];
  });
  return out;
}

}  // namespace fieldmark
