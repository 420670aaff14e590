#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace fieldmark {

/// Bump allocator. Each block is at least twice as large as the last; reset() keeps all blocks, so that the
/// second training step allocates nothing. It runs no destructors: Tape requires trivial ones at compile
/// time. Under AddressSanitizer, unallocated memory is poisoned, including a gap after each allocation.
class Arena {
 public:
  static constexpr std::size_t kAlign = 64;       ///< alignment of allocate(), bytes
  static constexpr std::size_t kSmallAlign = 16;  ///< alignment of allocate_small(), bytes
  /// @param first_block  bytes of the first block, which is allocated on first use
  explicit Arena(std::size_t first_block = std::size_t{1} << 16) : first_block_(first_block) {}
  /// Allocates uninitialised memory, valid until reset(). @throws std::bad_alloc
  void* allocate(std::size_t bytes) { return take(bytes, kAlign); }
  /// Like allocate(), but aligned only to kSmallAlign: for a few numbers and pointers, so that several of
  /// them share a cache line.
  void* allocate_small(std::size_t bytes) { return take(bytes, kSmallAlign); }
  /// Frees all allocations and keeps the blocks.
  void reset() noexcept;
  /// Fills free memory and all later blocks with bytes of 0xff, a NaN in floating point, so that a subsequent
  /// check notices unfilled values.
  void spoil() noexcept;
  std::size_t reserved() const;                        ///< bytes allocated from the system
  std::size_t used() const;                            ///< bytes of these in use, gaps included
  std::size_t system_calls() const { return grown_; }  ///< number of blocks allocated from the system

 private:
  struct Free {
    void operator()(std::byte* p) const;
  };
  struct Block {
    std::unique_ptr<std::byte[], Free> data;
    std::size_t size = 0;
  };
#if defined(__SANITIZE_ADDRESS__)
  static constexpr bool kSanitized = true;
#else
  static constexpr bool kSanitized = false;
#endif
  void* take(std::size_t bytes, std::size_t align) {
    const std::size_t gap = -reinterpret_cast<std::uintptr_t>(next_) & (align - 1);
    if (kSanitized || gap > room_ || bytes - 1 >= room_ - gap) [[unlikely]]
      return allocate_slowly(bytes);
    std::byte* p = next_ + gap;
    next_ = p + bytes;
    room_ -= gap + bytes;
    return p;
  }
  void* allocate_slowly(std::size_t bytes);
  void grow(std::size_t bytes);
  void begin_block(std::size_t k);
  std::vector<Block> blocks_;
  std::size_t first_block_, block_ = 0, grown_ = 0;
  std::byte* next_ = nullptr;  // start of the free memory in block block_
  std::size_t room_ = 0;       // its bytes
  bool spoils_ = false;
};

}  // namespace fieldmark
