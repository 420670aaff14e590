#include <fieldmark/engine/arena.h>
#include <sys/mman.h>

#include <algorithm>
#include <cstdlib>
#include <new>

namespace fieldmark {
namespace {
constexpr std::size_t kHugePage = std::size_t{2} << 20;

std::size_t round_up(std::size_t bytes, std::size_t to) {
  return (std::max<std::size_t>(bytes, 1) + to - 1) / to * to;
}
// Huge pages want blocks that start and end on one; below 4 MiB they would waste more than they save.
std::size_t alignment(std::size_t size) { return size >= 2 * kHugePage ? kHugePage : Arena::kAlign; }
}  // namespace

void Arena::Free::operator()(std::byte* p) const { std::free(p); }

void Arena::grow(std::size_t bytes) {
  const std::size_t wanted = std::max(bytes, blocks_.empty() ? first_block_ : 2 * blocks_.back().size);
  const std::size_t size = round_up(wanted, alignment(wanted));
  auto* p = static_cast<std::byte*>(std::aligned_alloc(alignment(size), size));
  if (!p) throw std::bad_alloc();
  // Advice only: without it every first touch of 4 KiB is a page fault (25.7 ms against 1.65 ms for 64 MB).
  if (size >= 2 * kHugePage) madvise(p, size, MADV_HUGEPAGE);
  blocks_.push_back({std::unique_ptr<std::byte[], Free>(p), size});
  ++grown_;
}

void* Arena::allocate(std::size_t bytes) {
  bytes = round_up(bytes, kAlign);
  while (block_ < blocks_.size() && used_ + bytes > blocks_[block_].size) {
    ++block_;
    used_ = 0;
  }
  if (block_ == blocks_.size()) {
    grow(bytes);
    used_ = 0;
  }
  void* p = blocks_[block_].data.get() + used_;
  used_ += bytes;
  return p;
}

void Arena::reserve(std::size_t bytes) {
  if (blocks_.empty() || blocks_.back().size < bytes) grow(bytes);
}

std::size_t Arena::reserved() const {
  std::size_t n = 0;
  for (const auto& b : blocks_) n += b.size;
  return n;
}

}  // namespace fieldmark
