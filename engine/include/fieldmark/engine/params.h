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
  trained,  ///< receives gradients; optimisers update it
  matrix,   ///< trained; weights [in, out] of matrix products, packed by PackedWeights
  table,    ///< trained; lookup rows [entries, features], which PackedWeights can round
  running   ///< state without gradient or steps, such as the running statistics of a batch norm
};
/// True if tensors of this role receive gradients.
constexpr bool is_trained(ParamRole role) { return role != ParamRole::running; }

/// True if a parameter's name matches a pattern, as in "extractor*" or "*bias": * stands for any characters,
/// slashes included, ? for one, [abc] for one of these.
bool name_matches(const std::string& pattern, const std::string& name);

/// Holds all parameters of a model in one flat buffer and their gradients in a second one of equal length, so
/// that an optimiser step, a checkpoint and zero_grad() are one loop each. Tensors of 4096 elements or more
/// start on a cache line; the gap before them stays zero.
template <class T>
class ParamStore {
 public:
  /// Where a tensor lies in the flat buffers.
  struct Entry {
    std::string name;                     ///< unique, slash separated: "field/density/weight"
    Shape shape;                          ///< row-major
    Index offset;                         ///< position of the first element in values()
    ParamRole role = ParamRole::trained;  ///< as declared to add()
  };
  /// Appends a tensor of zeros. Invalidates values that Params::leaf() recorded before.
  /// @throws ValueError if the name is taken
  /// @throws ShapeError if a matrix or a table does not have two axes
  ParamId add(std::string_view name, Shape shape, ParamRole role = ParamRole::trained);
  /// @{
  /// Checks that no parameter has this name, or is named "PREFIX/NAME": so a layer adds all of its parameters
  /// or none.   @throws ValueError if a name is taken
  void require_free(std::string_view name) const;
  void require_free(std::string_view prefix, std::initializer_list<std::string_view> names) const;
  /// @}
  /// Returns the id of a name. @throws ValueError if there is no such name
  ParamId find(std::string_view name) const;
  /// @{
  /// Returns the elements of a tensor; valid until the next add(). @throws ValueError if there is no such id
  std::span<T> values(ParamId id);
  std::span<const T> values(ParamId id) const;
  /// @}
  /// Returns the gradients of a tensor; valid until the next add(). @throws ValueError if the id is unknown
  std::span<T> grads(ParamId id);
  /// @{
  /// Returns the whole buffer of values [size()]; valid until the next add().
  std::span<T> values() { return values_; }
  std::span<const T> values() const { return values_; }
  /// @}
  /// Returns the whole buffer of gradients [size()], laid out like values().
  std::span<T> grads() { return grads_; }
  /// Returns all tensors in the order added.
  std::span<const Entry> entries() const { return entries_; }
  /// Returns the entry of an id. @throws ValueError if this store has no such id
  const Entry& entry(ParamId id) const;
  /// Returns the length of the buffers, including the gaps between tensors.
  Index size() const { return static_cast<Index>(values_.size()); }
  /// Returns the total number of elements of all tensors.
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
  /// Reads the store and adds gradients to it.
  explicit Params(ParamStore<T>& store) : Params(store, store.grads().data()) {}
  /// Reads the store and adds gradients to `grads`, laid out like the store's. If `grads` is null, no
  /// gradients are computed.
  Params(const ParamStore<T>& store, T* grads)
      : layout_(&store), values_(store.values().data()), entries_(store.entries().size()), grads_(grads) {}
  /// As above with packed matrices: `packed` must hold the store's current values and outlive the pass.
  /// @throws ValueError if they are of another store
  Params(const ParamStore<T>& store, T* grads, const PackedWeights<T>& packed);
  /// Reads `all` [store.size()], laid out like the store's values, and passes gradients on to it: for
  /// parameters that are themselves computed on the tape. Running ones are read from the store.
  /// @throws ShapeError if `all` has another number of elements
  Params(const ParamStore<T>& layout, Var<T> all);

  /// Records a parameter on the tape: as a leaf, or as a constant if gradients are not computed.
  /// @throws ValueError if parameters were added to the store since construction, or it has no such id
  Var<T> leaf(Tape<T>& tape, ParamId id) const;

 private:
  const ParamStore<T>* layout_;
  const T* values_;
  std::size_t entries_;  // of the store at construction; adding more moves its buffers
  T* grads_;
  const PackedWeights<T>* packed_ = nullptr;
  std::optional<Var<T>> all_ = {};  // computed parameters
};

}  // namespace fieldmark
