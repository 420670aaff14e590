#pragma once
#include <fieldmark/engine/isa.h>

#include <iostream>
#include <string>

/// True if this CPU multiplies in bf16. If not, prints the message that tools/test counts; what remains of
/// the test must then not need such products.
inline bool bf16_or_skip(const std::string& what) {
  if (fieldmark::bf16_units() != fieldmark::Bf16Units::none) return true;
  std::cout << "SKIPPED: " << what << " needs a CPU with bf16 products\n";
  return false;
}
