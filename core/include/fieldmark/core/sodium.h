#pragma once
#include <fieldmark/core/error.h>
#include <sodium.h>

namespace fieldmark {

// Initialises libsodium once; safe from any thread.
inline void ensure_sodium() {
  static const int status = sodium_init();
  if (status < 0) throw Error("[sodium] libsodium could not be initialised (no source of random numbers)");
}

}  // namespace fieldmark
