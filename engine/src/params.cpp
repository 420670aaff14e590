#include <fieldmark/engine/packed_weights.h>
#include <fieldmark/engine/params.h>
#include <fnmatch.h>

#include <limits>

#include "shortcuts.h"

namespace fieldmark {
namespace {

template <class T, class Entry>
std::span<T> slice_of(std::span<T> buffer, const Entry& e) {
  return buffer.subspan(static_cast<std::size_t>(e.offset), static_cast<std::size_t>(e.shape.size()));
}

}  // namespace

bool name_matches(const std::string& pattern, const std::string& name) {
  return ::fnmatch(pattern.c_str(), name.c_str(), FNM_NOESCAPE) == 0;
}

template <class T>
ParamId ParamStore<T>::add(std::string_view name, Shape shape, ParamRole role) {
  require_free(name);
  if ((role == ParamRole::matrix || role == ParamRole::table) && shape.rank() != 2)
    throw ShapeError("[params] '" + std::string(name) +
                     "' must have two axes to be a matrix or a table, got shape " + shape.str());
  // Offsets are the same for float and double, so that stores can be copied. 16 floats are a cache line.
  constexpr Index kLine = 16, kLarge = 4096;
  const Index offset = shape.size() >= kLarge ? (size() + kLine - 1) / kLine * kLine : size();
  if (shape.size() > std::numeric_limits<Index>::max() - offset)
    throw ShapeError("[params] '" + std::string(name) + "' is too large, got shape " + shape.str());
  const std::size_t before = values_.size();
  try {
    values_.resize(at(offset + shape.size()));
    grads_.resize(values_.size());
    entries_.push_back({std::string(name), shape, offset, role});
  } catch (...) {  // no memory: the store stays as it was
    values_.resize(before);
    grads_.resize(before);
    throw;
  }
  return {static_cast<int>(entries_.size()) - 1};
}

template <class T>
void ParamStore<T>::require_free(std::string_view name) const {
  for (const Entry& e : entries_)
    if (e.name == name) throw ValueError("[params] name '" + e.name + "' is already used");
}

template <class T>
void ParamStore<T>::require_free(std::string_view prefix,
                                 std::initializer_list<std::string_view> names) const {
  for (const std::string_view name : names) require_free(std::string(prefix) + "/" + std::string(name));
}

template <class T>
ParamId ParamStore<T>::find(std::string_view name) const {
  for (std::size_t i = 0; i < entries_.size(); ++i)
    if (entries_[i].name == name) return {static_cast<int>(i)};
  throw ValueError("[params] there is no parameter '" + std::string(name) + "'");
}

template <class T>
auto ParamStore<T>::entry(ParamId id) const -> const Entry& {
  if (id.index < 0 || static_cast<std::size_t>(id.index) >= entries_.size()) [[unlikely]]
    throw ValueError("[params] an id must be below the " + std::to_string(entries_.size()) +
                     " parameters of the store, got " + std::to_string(id.index));
  return entries_[static_cast<std::size_t>(id.index)];
}

template <class T>
std::span<T> ParamStore<T>::values(ParamId id) {
  return slice_of(values(), entry(id));
}

template <class T>
std::span<const T> ParamStore<T>::values(ParamId id) const {
  return slice_of(values(), entry(id));
}

template <class T>
std::span<T> ParamStore<T>::grads(ParamId id) {
  return slice_of(grads(), entry(id));
}

template <class T>
Index ParamStore<T>::parameters() const {
  Index sum = 0;
  for (const Entry& e : entries_) sum += e.shape.size();
  return sum;
}

template <class T>
void ParamStore<T>::zero_grad() {
  std::fill(grads_.begin(), grads_.end(), T(0));
}

template <class T>
Params<T>::Params(const ParamStore<T>& layout, Var<T> all) : Params(layout, nullptr) {
  if (all.shape().size() != layout.size())
    throw ShapeError("[params] all must have the " + std::to_string(layout.size()) +
                     " elements of the store, got shape " + all.shape().str());
  all_ = all;
}

template <class T>
Params<T>::Params(const ParamStore<T>& store, T* grads, const PackedWeights<T>& packed)
    : Params(store, grads) {
  if (!packed.packs(store)) throw ValueError("[params] packed must be of the same store");
  packed_ = &packed;
}

template <class T>
Var<T> Params<T>::leaf(Tape<T>& tape, ParamId id) const {
  if (layout_->entries().size() != entries_ || layout_->values().data() != values_) [[unlikely]]
    throw ValueError(
        "[params] the store has other buffers than when these Params were made: make them after the last "
        "add()");
  const auto& e = layout_->entry(id);
  const bool trained = is_trained(e.role);
  if (all_ && trained) return tape.name(tape.part(*all_, e.offset, e.shape), e.name);
  const Var<T> v =
      detail::Shortcuts<T>::matrix(tape, values_ + e.offset, grads_ && trained ? grads_ + e.offset : nullptr,
                                   e.shape, packed_ ? packed_->find(id) : nullptr);
  return tape.name(v, e.name);
}

template class Params<float>;
template class Params<double>;
template class ParamStore<float>;
template class ParamStore<double>;

}  // namespace fieldmark
