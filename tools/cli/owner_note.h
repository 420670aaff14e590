#pragma once
#include <fieldmark/watermark/mark/owner.h>

#include "cli/context.h"

namespace fieldmark::cli {

/// Notes that the bound of the p-values is not proven if the owner's networks depend on its key (version
/// 0.1), see Owner::key_free().
void note_unproven_bound(const watermark::Owner& owner, Context& context);

}  // namespace fieldmark::cli
