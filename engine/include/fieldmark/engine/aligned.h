#pragma once
#include <cstddef>
#include <vector>

namespace fieldmark {

/// Memory that starts on a cache line (64 bytes, enough for AVX-512); from 4 MiB on it starts on a huge page
/// of 2 MiB, which the system is asked to use: random reads of a 32 MB table otherwise wait for page tables
/// as long as for data. Uninitialised. @throws std::bad_alloc
void* allocate_aligned(std::size_t bytes);
/// Gives back what allocate_aligned() returned; null is allowed.
void free_aligned(void* p) noexcept;

/// allocate_aligned() for containers.
template <class T>
struct AlignedAllocator {
  /// What containers ask an allocator for.
  using value_type = T;
  AlignedAllocator() = default;
  /// All are equal: there is no state.
  template <class U>
  AlignedAllocator(const AlignedAllocator<U>&) noexcept {}
  /// Room for n objects, uninitialised. @throws std::bad_alloc
  T* allocate(std::size_t n) { return static_cast<T*>(allocate_aligned(n * sizeof(T))); }
  /// Gives back what allocate() returned.
  void deallocate(T* p, std::size_t) noexcept { free_aligned(p); }
  /// Always true: memory of one can be freed by another.
  bool operator==(const AlignedAllocator&) const = default;
};

/// A vector on aligned memory; its growth moves the numbers.
template <class T>
using AlignedVector = std::vector<T, AlignedAllocator<T>>;

}  // namespace fieldmark
