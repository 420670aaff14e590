#pragma once
#include <string>

#include "support/temporary_folder.h"
#include "watermark/test_key.h"

/// Writes a KEY file of test_key(first) into the folder. The command draws keys only from the operating
/// system, but a test that embeds must write the same bytes each time. @return its path
inline std::string test_key_file(const TemporaryFolder& folder, unsigned first = 5) {
  const std::string path = folder / ("key" + std::to_string(first));
  fieldmark::watermark::save_key(path, test_key(first));
  return path;
}
