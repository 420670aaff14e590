#pragma once
#include <cstddef>
#include <vector>

namespace fieldmark {

/// Uninitialised memory on a 64-byte boundary; from 4 MiB on, in huge pages of 2 MiB: random reads of a 32 MB
/// table otherwise wait as long for page tables as for data. @throws std::bad_alloc
void* allocate_aligned(std::size_t bytes);
/// Frees memory of allocate_aligned(); null is allowed.
void free_aligned(void* p) noexcept;

/// allocate_aligned() for containers.
template <class T>
struct AlignedAllocator {
  using value_type = T;  ///< of the elements
  AlignedAllocator() = default;
  /// Allocators of all types are alike.
  template <class U>
  AlignedAllocator(const AlignedAllocator<U>&) noexcept {}
  /// Uninitialised memory for n objects. @throws std::bad_alloc
  T* allocate(std::size_t n) { return static_cast<T*>(allocate_aligned(n * sizeof(T))); }
  /// Frees memory of allocate().
  void deallocate(T* p, std::size_t) noexcept { free_aligned(p); }
  /// Always true: there is no state.
  bool operator==(const AlignedAllocator&) const = default;
};

/// A vector on aligned memory.
template <class T>
using AlignedVector = std::vector<T, AlignedAllocator<T>>;

}  // namespace fieldmark
