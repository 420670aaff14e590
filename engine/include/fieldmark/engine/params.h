#pragma once
#include <fieldmark/engine/aligned.h>
#include <fieldmark/engine/tape.h>

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace fieldmark {

/// Names one tensor of a ParamStore. Modules keep ids, never pointers: add() may move the buffers.
struct ParamId {
  int index = -1;
};

/// All trainable numbers of a model in one flat buffer, gradients in a second one of equal length,
/// so that an optimiser step, a checkpoint and zero_grad() are each one loop. Tensors of 4096 numbers or more
/// start on a cache line; the zeros before them get no gradient and stay.
template <class T>
class ParamStore {
 public:
  struct Entry {
    std::string name;  ///< unique, slash separated: "field/density/weight"
    Shape shape;
    Index offset;  ///< of the first element in values()
  };
  /// Appends a tensor of zeros. @throws ValueError if the name is taken
  ParamId add(std::string_view name, Shape shape);
  /// @throws ValueError if there is no such name
  ParamId find(std::string_view name) const;
  std::span<T> values(ParamId id);
  std::span<const T> values(ParamId id) const;
  std::span<T> grads(ParamId id);
  std::span<T> values() { return values_; }
  std::span<const T> values() const { return values_; }
  std::span<T> grads() { return grads_; }
  std::span<const Entry> entries() const { return entries_; }
  const Entry& entry(ParamId id) const { return entries_[static_cast<std::size_t>(id.index)]; }
  /// Length of the buffers, with the gaps between tensors.
  Index size() const { return static_cast<Index>(values_.size()); }
  /// Numbers in all tensors.
  Index parameters() const;
  void zero_grad();

 private:
  std::vector<Entry> entries_;
  AlignedVector<T> values_, grads_;
};

template <class T>
class PackedWeights;

/// Where a pass reads parameters and where it adds their gradients: the store itself, a shard's private
/// buffer, or nowhere (inference). Cheap to copy; the store must outlive it.
template <class T>
class Params {
 public:
  /// Reads the store, adds gradients to the store.
  explicit Params(ParamStore<T>& store) : Params(store, store.values().data(), store.grads().data()) {}
  /// Reads the store; gradients, laid out as the store's, go to `grads`, or are not computed if it is null.
  Params(const ParamStore<T>& store, T* grads) : Params(store, store.values().data(), grads) {}
  /// The same with the store's matrices packed: `packed` holds its present values and outlives the pass.
  Params(const ParamStore<T>& store, T* grads, const PackedWeights<T>& packed) : Params(store, grads) {
    packed_ = &packed;
  }
  /// Reads `values` laid out as the store's: how gradcheck treats a module's parameters as an input.
  Params(const ParamStore<T>& layout, const T* values, T* grads)
      : layout_(&layout), values_(values), grads_(grads) {}

  Var<T> leaf(Tape<T>& tape, ParamId id) const;

 private:
  const ParamStore<T>* layout_;
  const T* values_;
  T* grads_;
  const PackedWeights<T>* packed_ = nullptr;
};

}  // namespace fieldmark
