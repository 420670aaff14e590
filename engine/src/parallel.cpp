#include <fieldmark/core/error.h>
#include <fieldmark/engine/parallel.h>
#include <omp.h>

#include <algorithm>
#include <atomic>
#include <exception>

namespace fieldmark {
namespace {

std::atomic<int> thread_count{0};  // 0: not chosen yet

/// Hands out the chunks of a loop. Each thread has a share of neighbouring chunks, so that it meets the same
/// data from loop to loop and its cache serves it; a thread whose share is done takes chunks from the others'
/// shares.
class ChunkShares {
 public:
  ChunkShares(Index chunks, int threads) : count_(std::min({Index{threads}, chunks, Index{kMost}})) {
    for (Index i = 0; i < count_; ++i) {
      shares_[i].next = chunks * i / count_;
      shares_[i].end = chunks * (i + 1) / count_;
    }
  }

  /// Calls f(chunk) for each chunk that no other thread has taken, those of the thread's own share first.
  template <class F>
  void run(int thread, F&& f) {
    for (Index i = 0; i < count_; ++i) {
      Share& share = shares_[(thread + i) % count_];
      const std::atomic_ref next(share.next);
      const auto take = [&] {
        // A look is cheaper than an atomic sum: most shares of the others are done by then.
        const bool done = next.load(std::memory_order_relaxed) >= share.end;
        return done ? share.end : next.fetch_add(1, std::memory_order_relaxed);
      };
      for (Index chunk = take(); chunk < share.end; chunk = take()) f(chunk);
    }
  }

 private:
  static constexpr int kMost = 64;
  struct alignas(64) Share {  // a cache line each: threads count without waiting for one another
    Index next;
    Index end;
  };
  Index count_;
  Share shares_[kMost];  // the first count_ are set
};

}  // namespace

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
  const auto run_or_keep_error = [&](Index chunk) {
    try {
      run(context, chunk);
    } catch (...) {
#pragma omp critical(fieldmark_parallel_error)
      if (chunk < failed) {
        failed = chunk;
        error = std::current_exception();
      }
    }
  };
  ChunkShares shares(chunks, n);
#pragma omp parallel num_threads(n)
  shares.run(omp_get_thread_num(), run_or_keep_error);
  if (error) std::rethrow_exception(error);
}

}  // namespace fieldmark
