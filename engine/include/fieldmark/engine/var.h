#pragma once
#include <fieldmark/core/error.h>
#include <fieldmark/engine/shape.h>

namespace fieldmark {

template <class T>
class Tape;
template <class T>
struct PackedMatrix;
namespace detail {
template <class T>
struct Shortcuts;
}

/// Handle to a value on a tape: a pointer, trivially copyable, valid until Tape::reset() or the end of the
/// tape. Include tape.h to use it.
template <class T>
class Var {
 public:
  /// Returns the extents of the value.
  const Shape& shape() const { return slot_->shape; }
  /// Returns the shape().size() values, row-major.
  const T* value() const { return slot_->value; }
  /// Returns the tape that holds the value.
  Tape<T>& tape() const { return *slot_->tape; }
  /// True if the value depends on a leaf, so that gradients reach it.
  bool needs_grad() const { return slot_->needs_grad; }
  /// Returns an identifier that is unique among the values of a tape.
  const void* id() const { return slot_; }
  /// Returns dL/d(this) accumulated so far, or nullptr before the first gradient. The gradient of a backward
  /// pass is valid until the next pass begins; the buffer of a leaf keeps accumulating.
  /// @throws ValueError for the output of a layer with a ReLU, unless Tape::keep_grad() requested it before
  /// the backward pass: by default only the gradient in front of the ReLU is computed
  const T* grad() const {
    if (slot_->rectified && slot_->grad) [[unlikely]]
      throw ValueError(
          "[grad] the gradient behind a ReLU is computed only if Tape::keep_grad() asked for it before the "
          "backward");
    return slot_->grad;
  }
  /// Returns the buffer that a backward adds to, zeroed on the first call, or nullptr if this input needs no
  /// gradient. Values written to it seed the next replay(); gradients of an earlier replay are discarded.
  T* grad_acc() const;
  /// Like grad_acc(), but leaves a new buffer uninitialised and sets *fresh: the caller then assigns every
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
    bool borrowed;   // grad is the caller's seed, which nobody writes to
    T* target;       // gradient buffer; null: from the arena
    const PackedMatrix<T>* packed;
    Tape<T>* tape;
  };
  explicit Var(Slot* s) : slot_(s) {}
  // As grad_acc(). masked: the caller writes 0 where a rectified value is not positive.
  T* grad_buffer(bool* fresh, bool masked) const;
  void copy_borrowed_gradient() const;
  Slot* slot_;
};

}  // namespace fieldmark
