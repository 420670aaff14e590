#pragma once
#include <fieldmark/engine/isa.h>

#include "support/catch.h"

/// Runs a check on every instruction set that this CPU supports, then restores the current one.
template <class F>
void each_isa(F&& check) {
  for (fieldmark::Isa level : {fieldmark::Isa::v2, fieldmark::Isa::v3, fieldmark::Isa::v4}) {
    if (level > fieldmark::isa_supported()) break;
    const fieldmark::ScopedIsa scope(level);
    CAPTURE(fieldmark::isa_name());
    check();
  }
}
