#pragma once
#include <string>

#include "support/temporary_folder.h"
#include "watermark/test_key.h"

/// A KEY file of test_key(first) in the folder: the command takes keys from the operating system only, and a
/// test that embeds must write the same bytes each time. @return its path
inline std::string test_key_file(const TemporaryFolder& folder, unsigned first = 5) {
  const std::string path = folder / ("key" + std::to_string(first));
  fieldmark::watermark::save_key(path, test_key(first));
  return path;
}
