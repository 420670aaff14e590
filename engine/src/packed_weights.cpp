#include <fieldmark/engine/packed_weights.h>

#include "ops/product.h"

namespace fieldmark {

template <class T>
PackedWeights<T>::PackedWeights(const ParamStore<T>& store)
    : store_(&store), matrices_(store.entries().size()) {}

template <class T>
void PackedWeights<T>::update() {
  const auto is_matrix = [](const auto& e) { return e.shape.rank() == 2 && e.name.ends_with("/weight"); };
  Index size = 0;
  for (const auto& e : store_->entries())
    if (is_matrix(e))
      size += detail::panels_size<T>(e.shape[0], e.shape[1]) + detail::panels_size<T>(e.shape[1], e.shape[0]);
  panels_.resize(static_cast<std::size_t>(size));
  T* to = panels_.data();
  for (std::size_t i = 0; i < matrices_.size(); ++i) {
    const auto& e = store_->entries()[i];
    if (!is_matrix(e)) continue;
    const Index in = e.shape[0], out = e.shape[1];
    const T* w = store_->values().data() + e.offset;
    matrices_[i].forward = to;
    detail::pack<T>(w, in, out, out, Index{1}, nullptr, to);
    to += detail::panels_size<T>(in, out);
    matrices_[i].transposed = to;
    detail::pack<T>(w, out, in, Index{1}, out, nullptr, to);
    to += detail::panels_size<T>(out, in);
  }
}

template class PackedWeights<float>;
template class PackedWeights<double>;

}  // namespace fieldmark
