#include <fieldmark/core/error.h>
#include <fieldmark/engine/parallel.h>
#include <omp.h>

#include <exception>

namespace fieldmark {
namespace {
int thread_count = 0;  // 0: not chosen yet
}

void set_threads(int n) {
  if (n < 1) throw ValueError("[set_threads] n must be at least 1, got " + std::to_string(n));
  thread_count = n;
}

int threads() { return thread_count > 0 ? thread_count : omp_get_max_threads(); }

void detail::parallel_chunks(Index chunks, void* context, void (*run)(void*, Index chunk)) {
  if (chunks == 1 || threads() == 1 || omp_in_parallel()) {
    for (Index c = 0; c < chunks; ++c) run(context, c);
    return;
  }
  std::exception_ptr error;
#pragma omp parallel for schedule(dynamic, 1) num_threads(threads())
  for (Index c = 0; c < chunks; ++c) {
    try {
      run(context, c);
    } catch (...) {
#pragma omp critical(fieldmark_parallel_error)
      if (!error) error = std::current_exception();
    }
  }
  if (error) std::rethrow_exception(error);
}

}  // namespace fieldmark
