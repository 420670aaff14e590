#pragma once
#include <fieldmark/engine/aligned.h>
#include <fieldmark/engine/tape.h>

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace fieldmark {

/// Names one tensor of a ParamStore. Modules keep ids, never pointers: add() may move the buffers.
struct ParamId {
  int index = -1;  ///< position among the entries; -1: none
};

/// What a tensor of a ParamStore is for.
enum class ParamRole {
  trained,  ///< gets gradients, and optimisers move it
  matrix,   ///< trained; weights [in, out] of products, which PackedWeights packs
  table,    ///< trained; rows [entries, features] that are looked up, which PackedWeights can round
  running   ///< a value that the model keeps, such as the statistics of a batch norm: no gradient, no steps
};
/// Whether tensors of this role get gradients.
constexpr bool is_trained(ParamRole role) { return role != ParamRole::running; }

/// All parameters of a model in one flat buffer, their gradients in a second one of equal length: an
/// optimiser step, a checkpoint and zero_grad() are each one loop. Tensors of 4096 elements or more start on
/// a cache line; the gap before them stays zero.
template <class T>
class ParamStore {
 public:
  /// Where a tensor lies in the flat buffers.
  struct Entry {
    std::string name;                     ///< unique, slash separated: "field/density/weight"
    Shape shape;                          ///< row-major
    Index offset;                         ///< of the first element in values()
    ParamRole role = ParamRole::trained;  ///< as declared to add()
  };
  /// Appends a tensor of zeros. Values that Params::leaf() put on a tape before are no longer valid.
  /// @throws ValueError if the name is taken
  /// @throws ShapeError if a matrix or a table has not two axes
  ParamId add(std::string_view name, Shape shape, ParamRole role = ParamRole::trained);
  /// @throws ValueError if there is no such name
  ParamId find(std::string_view name) const;
  /// @{
  /// The elements of one tensor; valid until the next add(). @throws ValueError if there is no such id
  std::span<T> values(ParamId id);
  std::span<const T> values(ParamId id) const;
  /// @}
  /// The gradients of one tensor; valid until the next add(). @throws ValueError if there is no such id
  std::span<T> grads(ParamId id);
  /// @{
  /// The whole buffer of values [size()]; valid until the next add().
  std::span<T> values() { return values_; }
  std::span<const T> values() const { return values_; }
  /// @}
  /// The whole buffer of gradients [size()], laid out as values().
  std::span<T> grads() { return grads_; }
  /// All tensors in the order added.
  std::span<const Entry> entries() const { return entries_; }
  /// The entry of an id of this store. @throws ValueError if it has no such id
  const Entry& entry(ParamId id) const;
  /// Length of the buffers, with the gaps between tensors.
  Index size() const { return static_cast<Index>(values_.size()); }
  /// Elements of all tensors.
  Index parameters() const;
  /// Sets all gradients to 0.
  void zero_grad();

 private:
  std::vector<Entry> entries_;
  AlignedVector<T> values_, grads_;
};

template <class T>
class PackedWeights;

/// The source of a pass's parameters and the target of their gradients: the store itself, a shard's private
/// buffer, or none (inference). Cheap to copy; the store must outlive it.
template <class T>
class Params {
 public:
  /// Reads the store, adds gradients to the store.
  explicit Params(ParamStore<T>& store) : Params(store, store.grads().data()) {}
  /// Reads the store; gradients, laid out as the store's, go to `grads`, or are not computed if it is null.
  Params(const ParamStore<T>& store, T* grads)
      : layout_(&store), values_(store.values().data()), entries_(store.entries().size()), grads_(grads) {}
  /// The same with the store's matrices packed: `packed` holds its present values and outlives the pass.
  Params(const ParamStore<T>& store, T* grads, const PackedWeights<T>& packed) : Params(store, grads) {
    packed_ = &packed;
  }
  /// Reads `all` [store.size()], laid out as the store's values, and passes gradients on to it: for
  /// parameters that are themselves computed. Running ones are read from the store.
  /// @throws ShapeError if `all` has another number of elements
  Params(const ParamStore<T>& layout, Var<T> all);

  /// A parameter on the tape: a leaf, or a constant where gradients are not computed.
  /// @throws ValueError if the store got more parameters since the constructor, or has no such id
  Var<T> leaf(Tape<T>& tape, ParamId id) const;

 private:
  const ParamStore<T>* layout_;
  const T* values_;
  std::size_t entries_;  // of the store at first: with more of them it has other buffers
  T* grads_;
  const PackedWeights<T>* packed_ = nullptr;
  std::optional<Var<T>> all_ = {};  // computed parameters
};

}  // namespace fieldmark
