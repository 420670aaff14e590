#pragma once
#include <fieldmark/engine/params.h>

#include <memory>
#include <span>
#include <vector>

namespace fieldmark {

/// The loop of a training step: chunks of work (rays, images) run on several threads, each with its own tape,
/// and their parameter gradients are summed in an order that does not depend on the thread count.
///
/// Chunks are dealt in order to a fixed number of shards. One thread processes a shard, chunk by chunk, into
/// the shard's own gradient buffer; afterwards the buffers are added in shard order. A chunk's forward, loss
/// and backward run back to back, so that its activations stay in the core's cache: forward over a whole
/// batch and then backward over the whole batch costs 20-30% more on 64-wide layers.
template <class T>
class ShardedLoop {
 public:
  /// @param shards  fixed number of gradient buffers, 1 to 256   @param grads  elements of each
  ShardedLoop(int shards, Index grads);

  /// Runs all chunks and adds the summed gradients to `into`, which is at most as long as given at
  /// construction.
  /// @param body  called as double(Index chunk, Index shard, Tape<T>& tape, T* grads) for each chunk: records
  /// on the (reset) tape, calls backward, adds its parameter gradients to `grads` and returns its share of
  /// the loss. A shard's chunks never run at the same time, so `shard` may index the caller's scratch.
  /// @return the losses summed in chunk order
  template <class F>
  double run(Index chunks, F&& body, std::span<T> into) {
    // Passed by reference: a std::function of a large body would allocate in every step.
    auto* f = &body;
    const Body call = [](void* p, Index chunk, Index shard, Tape<T>& tape, T* grads) -> double {
      return (**static_cast<decltype(f)*>(p))(chunk, shard, tape, grads);
    };
    return run_chunks(chunks, &f, call, into);
  }
  /// Returns the number of gradient buffers.
  int shards() const { return shards_; }
  /// Returns a shard's tape, for other work between runs. It keeps the memory of earlier chunks.
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
