#pragma once
#include <fieldmark/engine/isa.h>

#include "support/catch.h"

/// Runs a check on every instruction set this CPU has, then goes back to the one in use.
template <class F>
void each_isa(F&& check) {
  const fieldmark::Isa before = fieldmark::isa();
  for (fieldmark::Isa level : {fieldmark::Isa::v2, fieldmark::Isa::v3, fieldmark::Isa::v4}) {
    if (level > fieldmark::isa_supported()) break;
    fieldmark::force_isa(level);
    CAPTURE(fieldmark::isa_name());
    check();
  }
  fieldmark::force_isa(before);
}
