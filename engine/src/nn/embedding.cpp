#include <fieldmark/engine/nn/embedding.h>
#include <fieldmark/engine/ops/rows.h>
#include <fieldmark/engine/random.h>

namespace fieldmark {

template <class T>
Embedding<T>::Embedding(ParamStore<T>& store, std::string_view name, const EmbeddingOptions& options,
                        std::uint64_t seed) {
  if (options.count < 1 || options.width < 1)
    throw ValueError("[Embedding] count and width must be at least 1, got count " +
                     std::to_string(options.count) + " and width " + std::to_string(options.width));
  table_ = store.add(std::string(name) + "/table", {options.count, options.width}, ParamRole::table);
  const std::span<T> values = store.values(table_);
  const CounterRng rng(seed);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<T>(rng.normal4(i / 4)[i % 4]);
}

template <class T>
Var<T> Embedding<T>::operator()(Tape<T>& tape, const Params<T>& params,
                                std::span<const std::int32_t> index) const {
  return gather_rows(params.leaf(tape, table_), index);
}

template class Embedding<float>;
template class Embedding<double>;

}  // namespace fieldmark
