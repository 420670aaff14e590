#pragma once
#include <cstddef>
#include <vector>

namespace fieldmark {

/// Memory that starts on a cache line (64 bytes, enough for AVX-512); from 4 MiB on it starts on a huge page
/// of 2 MiB, which the system is asked to use: random reads of a 32 MB table otherwise wait for page tables
/// as long as for data. Uninitialised. @throws std::bad_alloc
void* allocate_aligned(std::size_t bytes);
void free_aligned(void* p) noexcept;

/// allocate_aligned() for containers.
template <class T>
struct AlignedAllocator {
  using value_type = T;
  AlignedAllocator() = default;
  template <class U>
  AlignedAllocator(const AlignedAllocator<U>&) noexcept {}
  T* allocate(std::size_t n) { return static_cast<T*>(allocate_aligned(n * sizeof(T))); }
  void deallocate(T* p, std::size_t) noexcept { free_aligned(p); }
  bool operator==(const AlignedAllocator&) const = default;
};

template <class T>
using AlignedVector = std::vector<T, AlignedAllocator<T>>;

}  // namespace fieldmark
