#pragma once
// What the layers of this room know about each other's values, to save passes over memory. Private.
#include <fieldmark/engine/packed_weights.h>
#include <fieldmark/engine/tape.h>

namespace fieldmark::detail {

template <class T>
struct Shortcuts {
  // Returns the packed form of a matrix, or null.
  static const PackedMatrix<T>* packed(Var<T> v) { return v.slot_->packed; }
  // Records a matrix with its packed form. grad: null for a constant.
  static Var<T> matrix(Tape<T>& tape, const T* value, T* grad, Shape shape, const PackedMatrix<T>* packed) {
    return tape.make(value, grad, shape, grad != nullptr, packed);
  }

  // True for the output of a ReLU whose gradient nobody reads (Tape::keep_grad). The gradient then matters
  // only where the value is positive: an op that reads the value anyway may mask the gradient, which saves
  // the ReLU's backward a pass over memory.
  static bool rectified(Var<T> v) { return v.slot_->rectified; }
  static void mark_rectified(Var<T> out) { out.slot_->rectified = true; }
  // True if every gradient added so far was masked.
  static bool grad_masked(Var<T> v) { return v.slot_->masked; }
  // As Var::grad_acc(&fresh). masked: the caller writes 0 where a rectified value is not positive.
  static T* grad_acc(Var<T> v, bool* fresh, bool masked) { return v.grad_buffer(fresh, masked); }
  // Returns the gradient as it is, masked or not.
  static const T* grad(Var<T> v) { return v.slot_->grad; }
};

}  // namespace fieldmark::detail
