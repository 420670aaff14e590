#pragma once
#include <fieldmark/engine/params.h>

#include <functional>
#include <memory>
#include <span>
#include <vector>

namespace fieldmark {

/// The loop of a training step: chunks of work (rays, images) run on several threads, each with its own tape,
/// and their parameter gradients are summed in an order that no thread count can change.
///
/// Chunks are dealt in order to a fixed number of shards. A shard is processed by one thread, chunk after
/// chunk, into the shard's own gradient buffer; afterwards the shards are added up in shard order. A chunk's
/// forward, loss and backward run back to back, so that its activations stay in the core's cache: forward
/// over a whole batch and then backward over the whole batch costs 20-30% more on 64-wide layers.
template <class T>
class ShardedLoop {
 public:
  /// @param shards  fixed number of gradient buffers, 1 to 256   @param grads  numbers in each
  ShardedLoop(int shards, Index grads);

  /// What a chunk does: record on the (reset) tape, call backward, add its parameter gradients to `grads`. A
  /// shard's chunks never run at the same time, so `shard` may index scratch of the caller's. Returns its
  /// share of the loss.
  using Body = std::function<double(Index chunk, Index shard, Tape<T>& tape, T* grads)>;
  /// Runs all chunks and adds the summed gradients to `into`, whose length is at most that given at
  /// construction.
  /// @return the losses summed in chunk order
  double run(Index chunks, const Body& body, std::span<T> into);
  /// Number of gradient buffers, as constructed.
  int shards() const { return shards_; }

 private:
  int shards_;
  Index grads_;
  std::vector<std::vector<T>> buffers_;
  std::vector<std::unique_ptr<Tape<T>>> tapes_;
  std::vector<double> losses_;
};

}  // namespace fieldmark
