#include <fieldmark/engine/aligned.h>
#include <fieldmark/engine/arena.h>

#include <algorithm>

namespace fieldmark {
namespace {
std::size_t round_up(std::size_t bytes, std::size_t to) {
  return (std::max<std::size_t>(bytes, 1) + to - 1) / to * to;
}
}  // namespace

void Arena::Free::operator()(std::byte* p) const { free_aligned(p); }

void Arena::grow(std::size_t bytes) {
  const std::size_t wanted = std::max(bytes, blocks_.empty() ? first_block_ : 2 * blocks_.back().size);
  const std::size_t size = round_up(wanted, kAlign);
  blocks_.push_back(
      {std::unique_ptr<std::byte[], Free>(static_cast<std::byte*>(allocate_aligned(size))), size});
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

std::size_t Arena::reserved() const {
  std::size_t n = 0;
  for (const auto& b : blocks_) n += b.size;
  return n;
}

}  // namespace fieldmark
