#pragma once
#include <fieldmark/engine/params.h>

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

  /// Runs all chunks and adds the summed gradients to `into`, whose length is at most that given at
  /// construction.
  /// @param body  called as double(Index chunk, Index shard, Tape<T>& tape, T* grads) for each chunk: records
  /// on the (reset) tape, calls backward, adds its parameter gradients to `grads` and returns its share of
  /// the loss. A shard's chunks never run at the same time, so `shard` may index scratch of the caller's.
  /// @return the losses summed in chunk order
  template <class F>
  double run(Index chunks, F&& body, std::span<T> into) {
    // By reference: a std::function of a large body would allocate in every step.
    auto* f = &body;
    const Body call = [](void* p, Index chunk, Index shard, Tape<T>& tape, T* grads) -> double {
      return (**static_cast<decltype(f)*>(p))(chunk, shard, tape, grads);
    };
    return run_chunks(chunks, &f, call, into);
  }
  /// Number of gradient buffers, as constructed.
  int shards() const { return shards_; }
  /// A shard's tape, for other work between runs: it comes with the room of earlier chunks.
  Tape<T>& tape(Index shard) { return *tapes_[static_cast<std::size_t>(shard)]; }

 private:
  using Body = double (*)(void* context, Index chunk, Index shard, Tape<T>& tape, T* grads);
  double run_chunks(Index chunks, void* context, Body body, std::span<T> into);

  int shards_;
  Index grads_;
  std::vector<std::vector<T>> buffers_;
  std::vector<std::unique_ptr<Tape<T>>> tapes_;
  std::vector<double> losses_;
};

}  // namespace fieldmark
