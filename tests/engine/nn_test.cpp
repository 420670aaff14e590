#include <fieldmark/engine/nn.h>

#include "support/folder_headers.h"

TEST_CASE("nn.h has every header of its folder") { expect_headers_of_folder("nn"); }
