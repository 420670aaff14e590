#include <fieldmark/engine/ops.h>

#include "support/folder_headers.h"

TEST_CASE("ops.h has every header of its folder") { expect_headers_of_folder("ops"); }
