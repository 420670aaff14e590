#include "cli/owner_note.h"

namespace fieldmark::cli {

void note_unproven_bound(const watermark::Owner& owner, Context& context) {
  if (!owner.key_free())
    context.note(
        "the networks of this owner file were trained under its own key (version 0.1), so the bound of its "
        "p-values is not proven; embed it anew for one that is");
}

}  // namespace fieldmark::cli
