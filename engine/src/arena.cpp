#include <fieldmark/engine/aligned.h>
#include <fieldmark/engine/arena.h>

#include <sanitizer/asan_interface.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <new>

namespace fieldmark {
namespace {

#if defined(__SANITIZE_ADDRESS__)
constexpr std::size_t kGap = Arena::kAlign;  // after each allocation, poisoned
#else
constexpr std::size_t kGap = 0;
#endif

constexpr int kSpoilt = 0xff;

// A size above half of the address space comes from a converted negative number.
std::size_t round_up(std::size_t bytes, std::size_t to) {
  if (bytes > std::numeric_limits<std::size_t>::max() / 2) throw std::bad_alloc();
  return (std::max<std::size_t>(bytes, 1) + to - 1) / to * to;
}

}  // namespace

void Arena::Free::operator()(std::byte* p) const { free_aligned(p); }

void Arena::grow(std::size_t bytes) {
  const std::size_t wanted = std::max(bytes, blocks_.empty() ? first_block_ : 2 * blocks_.back().size);
  const std::size_t size = round_up(wanted, kAlign);
  blocks_.push_back(
      {std::unique_ptr<std::byte[], Free>(static_cast<std::byte*>(allocate_aligned(size))), size});
  if (spoils_) std::memset(blocks_.back().data.get(), kSpoilt, size);
  ASAN_POISON_MEMORY_REGION(blocks_.back().data.get(), size);
  ++grown_;
}

void Arena::begin_block(std::size_t k) {
  block_ = k;
  next_ = blocks_[k].data.get();
  room_ = blocks_[k].size;
}

void* Arena::allocate_slowly(std::size_t bytes) {
  const std::size_t taken = round_up(bytes, kAlign) + kGap;
  const auto gap = [&] { return -reinterpret_cast<std::uintptr_t>(next_) & (kAlign - 1); };
  while (!next_ || room_ < taken + gap()) {
    if (!next_ || block_ + 1 == blocks_.size()) grow(taken);
    begin_block(next_ ? block_ + 1 : 0);
  }
  std::byte* p = next_ + gap();
  room_ -= taken + gap();
  next_ = p + taken;
  ASAN_UNPOISON_MEMORY_REGION(p, bytes);
  return p;
}

void Arena::reset() noexcept {
  for (const auto& b : blocks_) ASAN_POISON_MEMORY_REGION(b.data.get(), b.size);
  if (!blocks_.empty()) begin_block(0);
}

void Arena::spoil() noexcept {
  spoils_ = true;
  for (std::size_t k = block_; k < blocks_.size(); ++k) {
    std::byte* begin = k == block_ ? next_ : blocks_[k].data.get();
    const std::size_t bytes = k == block_ ? room_ : blocks_[k].size;
    ASAN_UNPOISON_MEMORY_REGION(begin, bytes);
    std::memset(begin, kSpoilt, bytes);
    ASAN_POISON_MEMORY_REGION(begin, bytes);
  }
}

std::size_t Arena::used() const {
  if (blocks_.empty()) return 0;
  std::size_t n = blocks_[block_].size - room_;
  for (std::size_t k = 0; k < block_; ++k) n += blocks_[k].size;
  return n;
}

std::size_t Arena::reserved() const {
  std::size_t n = 0;
  for (const auto& b : blocks_) n += b.size;
  return n;
}

}  // namespace fieldmark
