#pragma once
#include <fieldmark/core/error.h>
#include <fieldmark/engine/arena.h>
#include <fieldmark/engine/shape.h>
#include <fieldmark/engine/tensor.h>

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

template <class T>
class Tape;

namespace detail {
// g[i] = or += seed[i], or 0 where mask (null: none) is not positive.
template <class T>
void seed_gradient(const T* seed, const T* mask, bool fresh, T* g, Index n);
template <class T>
struct Shortcuts;
}  // namespace detail

template <class T>
struct PackedMatrix;

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
  /// Tells the values of a tape apart.
  const void* id() const { return slot_; }
  /// dL/d(this) accumulated so far; nullptr before the first gradient. After a backward it is that backward's
  /// until the next one begins; a leaf's buffer goes on adding up.
  /// @throws ValueError for the output of a layer with a ReLU, unless Tape::keep_grad() asked for it before
  /// the backward: without that, only the gradient in front of the ReLU is computed
  const T* grad() const {
    if (slot_->rectified && slot_->grad) [[unlikely]]
      throw ValueError(
          "[grad] the gradient behind a ReLU is computed only if Tape::keep_grad() asked for it before the "
          "backward");
    return slot_->grad;
  }
  /// The buffer to which a backward adds, zeroed on the first call; nullptr if this input needs no gradient.
  /// Written by hand, it seeds the next replay(): gradients of an earlier one are forgotten.
  T* grad_acc() const;
  /// As grad_acc(), but a new buffer stays uninitialised and *fresh is set: the caller then assigns every
  /// element instead of adding, which saves a pass over memory.
  T* grad_acc(bool* fresh) const;

 private:
  friend class Tape<T>;
  friend struct detail::Shortcuts<T>;
  struct Slot {
    const T* value;
    T* grad;
    Shape shape;
    bool needs_grad;
    bool rectified;  // a ReLU's output, whose gradient may be masked: 0 where the value is not positive
    bool masked;     // every gradient so far was masked
    T* target;       // buffer of the gradient; null: the arena's
    const PackedMatrix<T>* packed;
  };
  Var(Tape<T>* t, Slot* s) : tape_(t), slot_(s) {}
  // grad_acc(); masked: the caller writes 0 where a rectified value is not positive.
  T* grad_buffer(bool* fresh, bool masked) const;
  Tape<T>* tape_;
  Slot* slot_;
};

/// Is told what a tape records and replays. TapeInspector (inspect.h) shows the graph, times and the first
/// NaN.
template <class T>
class TapeObserver {
 public:
  virtual ~TapeObserver() = default;
  /// An op took memory for its output. @param from  the function that called Tape::output()
  virtual void made(Var<T> out, std::span<const Var<T>> inputs, const std::source_location& from) = 0;
  /// An op filled its output and handed over its backward.
  virtual void recorded(Var<T> out) = 0;
  /// A value got a name, see Tape::name().
  virtual void named(Var<T> v, std::string_view name) = 0;
  /// The backward of the op that made `out` is about to run.
  virtual void before_backward(Var<T> out) = 0;
  /// The backward of the op that made `out` has run.
  virtual void after_backward(Var<T> out) = 0;
  /// The tape forgot the pass.
  virtual void reset() = 0;
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
  /// A value that needs no gradient. The data must outlive the pass, so a temporary does not compile.
  /// @throws ShapeError unless the tensor has as many elements as its shape
  Var<T> constant(const Tensor<T>& t) { return constant(filled(t, "constant"), t.shape); }
  Var<T> constant(const Tensor<T>&& t) = delete;
  Var<T> constant(const T* value, Shape shape) { return make(value, nullptr, shape, false); }
  /// @}
  /// @{
  /// A parameter or another input to differentiate in: its gradient is added to `grad`.
  /// @throws ShapeError unless `grad` and the shape have as many elements as the tensor
  Var<T> leaf(const T* value, T* grad, Shape shape) { return make(value, grad, shape, true); }
  Var<T> leaf(const Tensor<T>& t, Tensor<T>& grad) {
    if (grad.size() != t.size())
      throw ShapeError("[leaf] grad must have the " + std::to_string(t.size()) + " elements of t, got " +
                       std::to_string(grad.size()));
    return leaf(filled(t, "leaf"), grad.data.data(), t.shape);
  }
  Var<T> leaf(const Tensor<T>&& t, Tensor<T>& grad) = delete;
  /// @}
  /// As leaf(), but the gradient of each backward overwrites `grad`; `grad` keeps its content if none
  /// arrives.
  Var<T> fresh_leaf(const T* value, T* grad, Shape shape) {
    const Var<T> v = make(value, nullptr, shape, true);
    v.slot_->target = grad;
    fresh_.push_back(v);
    return v;
  }
  /// @{
  /// Output of an op; *data points at uninitialised values, which the op fills.
  /// @param from  names the op for an observer
  /// @throws ValueError if an input was recorded on another tape
  Var<T> output(Shape shape, T** data, std::initializer_list<Var<T>> inputs,
                std::source_location from = std::source_location::current()) {
    return output(shape, data, std::span(inputs.begin(), inputs.size()), from);
  }
  Var<T> output(Shape shape, T** data, std::span<const Var<T>> inputs,
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
  /// Has the next backward compute dL/dv for Var::grad(), also where v is the output of a layer with a ReLU.
  /// Costs such a layer a pass over its output. @return v
  /// @throws ValueError if a backward came before
  Var<T> keep_grad(Var<T> v) {
    if (v.slot_->rectified && v.slot_->grad)
      throw ValueError("[keep_grad] must be called before the backward that computes the gradient");
    v.slot_->rectified = false;
    return v;
  }
  /// The same elements under another shape of equal size; gradients pass through unchanged.
  Var<T> reshape(Var<T> x, Shape shape);
  /// The elements of x from `begin` on under a shape of their own; gradients pass through unchanged.
  /// @throws ShapeError if they do not lie within x
  Var<T> part(Var<T> x, Index begin, Shape shape);
  /// Uninitialised memory until reset(), for values that a backward reads.
  /// @throws ValueError if n is negative or so large that its bytes cannot be counted
  template <class U = T>
  U* scratch(Index n) {
    static_assert(std::is_trivially_destructible_v<U>);
    if (n < 0 || n > std::numeric_limits<Index>::max() / static_cast<Index>(sizeof(U))) [[unlikely]]
      throw ValueError("[tape] a buffer must have 0 elements or more and fit into memory, got " +
                       std::to_string(n));
    return static_cast<U*>(arena_.allocate(static_cast<std::size_t>(n) * sizeof(U)));
  }

  /// Registers `fn(const T* dout)`, called once a backward, only if a gradient reached `out`. It leaves what
  /// it captured as it was: a second backward calls it again.
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

  /// Seeds dL/dloss = 1 and replays. Leaves add up over several calls; gradients of all other values begin
  /// anew in each. @throws ShapeError unless `loss` has exactly one element
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
    check_own(out, "the value to differentiate");
    if (static_cast<Index>(seed.size()) != out.shape().size())
      throw ShapeError("[backward] seed must have one element for each of out, whose shape is " +
                       out.shape().str() + ", got " + std::to_string(seed.size()));
    bool fresh = false;
    begin_pass();
    T* g = out.grad_buffer(&fresh, out.slot_->grad == nullptr);
    if (!g) throw ValueError("[backward] nothing to differentiate: no input of this value needs a gradient");
    const T* mask = fresh && out.slot_->rectified ? out.value() : nullptr;
    detail::seed_gradient(seed.data(), mask, fresh, g, out.shape().size());
    replay();
  }
  /// Replays from the gradients that the caller wrote to Var::grad_acc(): several outputs can be seeded by
  /// hand.
  void replay() {
    begin_pass();
    const Replaying replaying(phase_);
    if (observer_) [[unlikely]]
      return replay_observed();
    for (const Node* n = last_; n; n = n->before)
      if (const T* dout = n->out.slot_->grad) n->run(n, dout);
  }
  /// Forgets the recorded pass and keeps its memory for the next one; every Var of it becomes invalid.
  void reset() {
    last_ = nullptr;
    fresh_.clear();
    phase_ = Phase::recording;
    arena_.reset();
    if (observer_) [[unlikely]]
      observer_->reset();
  }
  /// Names a value for an observer; without one it does nothing. @return v
  Var<T> name(Var<T> v, std::string_view name) {
    if (observer_) [[unlikely]]
      observer_->named(v, name);
    return v;
  }
  /// Sets the observer of this tape, null: none. It must outlive the passes that it observes.
  void observe(TapeObserver<T>* observer) { observer_ = observer; }
  /// The observer, or null.
  TapeObserver<T>* observer() const { return observer_; }
  /// The memory of values, gradients and closures, for counting.
  Arena& arena() { return arena_; }

 private:
  friend class Var<T>;
  friend struct detail::Shortcuts<T>;
  enum class Phase : std::uint8_t { recording, replaying, replayed };
  // Ends with `replayed` even if a backward throws: what it left half done must not be added to.
  struct Replaying {
    explicit Replaying(Phase& p) : phase(p) { phase = Phase::replaying; }
    Replaying(const Replaying&) = delete;
    Replaying& operator=(const Replaying&) = delete;
    ~Replaying() { phase = Phase::replayed; }
    Phase& phase;
  };
  // A recorded backward, in front of what its function captured.
  struct Node {
    const Node* before;  // the one recorded before, or null
    Var<T> out;
    void (*run)(const Node*, const T* dout);
  };
  // After a replay: gradients that are not a leaf's begin anew, in the buffers that they have.
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
    if (slot.grad) slot.target = slot.grad;
    slot.grad = nullptr;
    slot.masked = true;
  }
  void check_own(const Var<T>& v, const char* what) const {
    if (v.tape_ != this) [[unlikely]]
      throw ValueError(std::string("[tape] ") + what +
                       " was recorded on another tape: record all that belongs together on one");
  }
  static const T* filled(const Tensor<T>& t, const char* where) {
    if (t.size() != t.shape.size())
      throw ShapeError("[" + std::string(where) + "] t must have the elements of its shape " + t.shape.str() +
                       ", got " + std::to_string(t.size()));
    return t.data.data();
  }
  Var<T> make(const T* value, T* grad, Shape shape, bool needs, const PackedMatrix<T>* packed = nullptr) {
    using Slot = typename Var<T>::Slot;
    return Var<T>(this, new (arena_.allocate_small(sizeof(Slot)))
                            Slot{value, grad, shape, needs, false, true, nullptr, packed});
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
  tape_->begin_pass();
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
