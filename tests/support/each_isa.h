#pragma once
#include <fieldmark/engine/isa.h>

#include "support/catch.h"

/// Runs a check on every instruction set this CPU has, then goes back to the one in use.
template <class F>
void each_isa(F&& check) {
  for (fieldmark::Isa level : {fieldmark::Isa::v2, fieldmark::Isa::v3, fieldmark::Isa::v4}) {
    if (level > fieldmark::isa_supported()) break;
    const fieldmark::ScopedIsa scope(level);
    CAPTURE(fieldmark::isa_name());
    check();
  }
}
