#pragma once
#include <fieldmark/engine/shape.h>

#include <type_traits>

namespace fieldmark {

/// Sets the number of threads of parallel loops; default: all of the machine. Nested loops stay serial.
/// @param n  1 to 1024   @throws ValueError otherwise
void set_threads(int n);
/// Returns the number of threads in use.
int threads();

/// Calls set_threads() and restores the previous number at the end of the scope, for tests and benchmarks.
class ScopedThreads {
 public:
  /// @param n  1 to 1024   @throws ValueError otherwise
  explicit ScopedThreads(int n);
  ScopedThreads(const ScopedThreads&) = delete;
  ScopedThreads& operator=(const ScopedThreads&) = delete;
  ~ScopedThreads();

 private:
  int before_;
};

namespace detail {
void parallel_chunks(Index chunks, void* context, void (*run)(void*, Index chunk));
/// True if a parallel loop started here would run on one thread: inside another parallel loop, or if there is
/// only one thread.
bool runs_on_one_thread();
}  // namespace detail

/// Calls f(begin, end) over [0, n) in chunks of `grain`, on several threads; runs serially inside another
/// parallel loop and for a single chunk. Chunks do not depend on the thread count, so a result that depends
/// only on the chunk has the same bits for any number of threads. Rethrows the exception of the first chunk
/// that failed, in the order of the chunks.
template <class F>
void parallel_for(Index n, Index grain, F&& f) {
  if (n <= 0) return;
  if (n <= grain) return static_cast<void>(f(Index{0}, n));
  struct Context {
    std::remove_reference_t<F>* f;
    Index n, grain;
  } context{&f, n, grain < 1 ? 1 : grain};
  detail::parallel_chunks((n + context.grain - 1) / context.grain, &context, [](void* p, Index chunk) {
    auto& c = *static_cast<Context*>(p);
    const Index begin = chunk * c.grain;
    (*c.f)(begin, begin + c.grain < c.n ? begin + c.grain : c.n);
  });
}

}  // namespace fieldmark
