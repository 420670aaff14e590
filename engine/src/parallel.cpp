#include <fieldmark/core/error.h>
#include <fieldmark/engine/parallel.h>
#include <omp.h>

#include <atomic>
#include <exception>

namespace fieldmark {
namespace {
std::atomic<int> thread_count{0};  // 0: not chosen yet
}

void set_threads(int n) {
  // Beyond what the system can start, OpenMP would end the process.
  constexpr int kMost = 1024;
  if (n < 1 || n > kMost)
    throw ValueError("[set_threads] n must be from 1 to 1024, got " + std::to_string(n));
  thread_count = n;
}

int threads() {
  const int n = thread_count.load(std::memory_order_relaxed);
  return n > 0 ? n : omp_get_max_threads();
}

ScopedThreads::ScopedThreads(int n) : before_(thread_count) { set_threads(n); }
ScopedThreads::~ScopedThreads() { thread_count = before_; }

bool detail::runs_on_one_thread() { return threads() == 1 || omp_in_parallel(); }

void detail::parallel_chunks(Index chunks, void* context, void (*run)(void*, Index chunk)) {
  const int n = threads();
  if (chunks == 1 || runs_on_one_thread()) {
    for (Index c = 0; c < chunks; ++c) run(context, c);
    return;
  }
  std::exception_ptr error;  // of the first chunk that failed, as in a serial loop
  Index failed = chunks;
#pragma omp parallel for schedule(dynamic, 1) num_threads(n)
  for (Index c = 0; c < chunks; ++c) {
    try {
      run(context, c);
    } catch (...) {
#pragma omp critical(fieldmark_parallel_error)
      if (c < failed) {
        failed = c;
        error = std::current_exception();
      }
    }
  }
  if (error) std::rethrow_exception(error);
}

}  // namespace fieldmark
