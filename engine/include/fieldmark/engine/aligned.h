#pragma once
#include <cstddef>
#include <vector>

namespace fieldmark {

/// Allocates uninitialised memory on a 64-byte boundary, from 4 MiB on in huge pages of 2 MiB: otherwise
/// random reads of a 32 MB table wait as long for page tables as for data. @throws std::bad_alloc
void* allocate_aligned(std::size_t bytes);
/// Frees memory from allocate_aligned(); null is allowed.
void free_aligned(void* p) noexcept;

/// Container allocator that uses allocate_aligned().
template <class T>
struct AlignedAllocator {
  using value_type = T;  ///< type of the elements
  AlignedAllocator() = default;
  /// Converts from an allocator of any type, since none has state.
  template <class U>
  AlignedAllocator(const AlignedAllocator<U>&) noexcept {}
  /// Allocates uninitialised memory for n objects. @throws std::bad_alloc
  T* allocate(std::size_t n) { return static_cast<T*>(allocate_aligned(n * sizeof(T))); }
  /// Frees memory from allocate().
  void deallocate(T* p, std::size_t) noexcept { free_aligned(p); }
  /// Always true: there is no state.
  bool operator==(const AlignedAllocator&) const = default;
};

/// A vector in aligned memory.
template <class T>
using AlignedVector = std::vector<T, AlignedAllocator<T>>;

}  // namespace fieldmark
