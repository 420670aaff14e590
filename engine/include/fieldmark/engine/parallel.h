#pragma once
#include <fieldmark/engine/shape.h>

#include <type_traits>

namespace fieldmark {

/// Sets the number of threads outside of an existing parallel region; default: all of the machine.
/// @param n  at least 1   @throws ValueError otherwise
void set_threads(int n);
/// The number of threads in use.
int threads();

/// set_threads() until the end of the scope, also if an exception ends it: for tests and benchmarks.
class ScopedThreads {
 public:
  /// @param n  at least 1   @throws ValueError otherwise
  explicit ScopedThreads(int n);
  ScopedThreads(const ScopedThreads&) = delete;
  ScopedThreads& operator=(const ScopedThreads&) = delete;
  ~ScopedThreads();

 private:
  int before_;
};

namespace detail {
void parallel_chunks(Index chunks, void* context, void (*run)(void*, Index chunk));
/// Whether a parallel loop started here would have one thread: another one runs already, or there is no
/// other.
bool runs_on_one_thread();
}  // namespace detail

/// Calls f(begin, end) over [0, n) in chunks of `grain`, on several threads; serial inside another parallel
/// loop and for a single chunk. Chunks do not depend on the thread count, so a result that depends only on
/// the chunk has the same bits for any number of threads. Rethrows an exception of f.
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
