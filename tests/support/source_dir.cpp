#include "support/source_dir.h"

std::string source_dir() { return FIELDMARK_SOURCE_DIR; }
