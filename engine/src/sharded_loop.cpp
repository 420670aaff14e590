#include <fieldmark/engine/parallel.h>
#include <fieldmark/engine/sharded_loop.h>

#include <algorithm>

namespace fieldmark {

template <class T>
ShardedLoop<T>::ShardedLoop(int shards, Index grads) : shards_(shards), grads_(grads) {
  if (shards < 1 || shards > 256)
    throw ValueError("[sharded_loop] shards must be 1 to 256, got " + std::to_string(shards));
  for (int s = 0; s < shards; ++s) {
    buffers_.emplace_back(static_cast<std::size_t>(grads));
    tapes_.push_back(std::make_unique<Tape<T>>());
  }
}

template <class T>
double ShardedLoop<T>::run_chunks(Index chunks, void* context, Body body, std::span<T> into) {
  if (static_cast<Index>(into.size()) > grads_)
    throw ShapeError("[sharded_loop] into must have at most " + std::to_string(grads_) + " numbers, got " +
                     std::to_string(into.size()));
  const auto n = static_cast<std::size_t>(chunks);
  if (losses_.capacity() < n) losses_.reserve(2 * n);  // a step with a few more chunks does not allocate
  losses_.assign(n, 0.0);
  parallel_for(shards_, 1, [&](Index s, Index) {
    auto& grads = buffers_[static_cast<std::size_t>(s)];
    std::fill(grads.begin(), grads.end(), T(0));
    Tape<T>& tape = *tapes_[static_cast<std::size_t>(s)];
    for (Index c = s * chunks / shards_; c < (s + 1) * chunks / shards_; ++c) {
      tape.reset();
      losses_[static_cast<std::size_t>(c)] = body(context, c, s, tape, grads.data());
    }
  });
  // One thread sums each element over the shards, in shard order.
  parallel_for(static_cast<Index>(into.size()), 8192, [&](Index begin, Index end) {
    for (const auto& grads : buffers_)
      for (Index i = begin; i < end; ++i)
        into[static_cast<std::size_t>(i)] += grads[static_cast<std::size_t>(i)];
  });
  double loss = 0;
  for (double l : losses_) loss += l;
  return loss;
}

template class ShardedLoop<float>;
template class ShardedLoop<double>;

}  // namespace fieldmark
