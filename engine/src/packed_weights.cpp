#include <fieldmark/engine/packed_weights.h>

#include <cstring>

#include "kernels/gemm_bf16.h"
#include "ops/product.h"

namespace fieldmark {
namespace {

bool is_matrix(const auto& entry) { return entry.role == ParamRole::matrix; }
bool is_table(const auto& entry) { return entry.role == ParamRole::table; }

}  // namespace

template <class T>
PackedWeights<T>::PackedWeights(const ParamStore<T>& store, const PackOptions& options)
    : store_(&store),
      options_(options),
      matrices_(store.entries().size()),
      tables_(matrices_.size()),
      witnesses_(matrices_.size()) {
  if (options.precision == Precision::fp32) return;
  if (std::is_same_v<T, double>)
    throw ValueError("[packed_weights] precision: bf16 stands in for float, not for double");
  if (bf16_units() == Bf16Units::none)
    throw ValueError(
        std::string("[packed_weights] precision: no bf16 products on this CPU with the kernels ") +
        isa_name());
}

template <class T>
void PackedWeights<T>::update() {
  if (matrices_.size() != store_->entries().size())
    throw ValueError("[packed_weights] the store has " + std::to_string(store_->entries().size()) +
                     " parameters, it had " + std::to_string(matrices_.size()) +
                     " when its weights were first packed: make PackedWeights after the last add()");
  const bool bf16 = options_.precision == Precision::bf16;
  Index size = 0, rounded = 0;
  for (const auto& e : store_->entries()) {
    if (is_matrix(e)) {
      size += detail::panels_size<T>(e.shape[0], e.shape[1]) + detail::panels_size<T>(e.shape[1], e.shape[0]);
      rounded += kernels::bf16_size(e.shape[0], e.shape[1]) + kernels::bf16_size(e.shape[1], e.shape[0]);
    }
    if (options_.tables && is_table(e)) rounded += e.shape.size();
  }
  panels_.resize(static_cast<std::size_t>(size));
  if (bf16) rounded_.resize(static_cast<std::size_t>(rounded));
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
  if constexpr (std::is_same_v<T, float>)
    if (bf16) update_rounded();
  for (std::size_t i = 0; i < matrices_.size(); ++i)
    if (matrices_[i].forward || tables_[i]) witnesses_[i] = witnesses(i);
  isa_ = isa();
}

template <class T>
const PackedMatrix<T>* PackedWeights<T>::find(ParamId id) const {
  const std::size_t i = place(id);
  if (!matrices_[i].forward) return nullptr;
  check_current(i);
  return &matrices_[i];
}

template <class T>
const std::uint16_t* PackedWeights<T>::table(ParamId id) const {
  const std::size_t i = place(id);
  if (tables_[i]) check_current(i);
  return tables_[i];
}

template <class T>
std::size_t PackedWeights<T>::place(ParamId id) const {
  if (id.index < 0 || at(id.index) >= matrices_.size())
    throw ValueError("[packed_weights] id must be one of the " + std::to_string(matrices_.size()) +
                     " parameters that the store had when its weights were first packed, got " +
                     std::to_string(id.index));
  return at(id.index);
}

// Samples elements evenly over the parameter, including the first and the last.
template <class T>
typename PackedWeights<T>::Witnesses PackedWeights<T>::witnesses(std::size_t i) const {
  const auto& e = store_->entries()[i];
  const T* values = store_->values().data() + e.offset;
  Witnesses seen{};
  for (std::size_t k = 0; k < kWitnesses && e.shape.size() > 0; ++k)
    seen[k] = values[static_cast<Index>(k) * (e.shape.size() - 1) / static_cast<Index>(kWitnesses - 1)];
  return seen;
}

template <class T>
void PackedWeights<T>::check_current(std::size_t i) const {
  if (isa_ != isa())
    throw ValueError(std::string("[packed_weights] weights were packed for another instruction set than ") +
                     isa_name() + ": call update() after a change of it");
  // Compares bits, so that a NaN equals itself.
  const Witnesses now = witnesses(i);
  if (std::memcmp(now.data(), witnesses_[i].data(), sizeof now) != 0)
    throw ValueError("[packed_weights] '" + store_->entries()[i].name +
                     "' has other values than when it was packed: call update() after every step");
}

template <class T>
void PackedWeights<T>::update_rounded() {
  using namespace kernels;
  const auto pack = FIELDMARK_KERNEL(pack_bf16);
  std::uint16_t* to = rounded_.data();
  for (std::size_t i = 0; i < matrices_.size(); ++i) {
    const auto& e = store_->entries()[i];
    const auto* w = reinterpret_cast<const float*>(store_->values().data() + e.offset);
    if (is_matrix(e)) {
      const Index in = e.shape[0], out = e.shape[1];
      matrices_[i].forward_bf16 = to;
      pack(w, in, out, out, 1, to);
      to += bf16_size(in, out);
      matrices_[i].transposed_bf16 = to;
      pack(w, out, in, 1, out, to);
      to += bf16_size(out, in);
    } else if (options_.tables && is_table(e)) {
      tables_[i] = to;
      parallel_for(e.shape.size(), Index{1} << 16, [&](Index b, Index n) {
        FIELDMARK_KERNEL(round_bf16)(w + b, n - b, to + b);
      });
      to += e.shape.size();
    }
  }
}

template class PackedWeights<float>;
template class PackedWeights<double>;

}  // namespace fieldmark
