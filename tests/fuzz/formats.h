#pragma once
#include <functional>
#include <string>
#include <vector>

/// A format of files that come from elsewhere, for fuzz_readers.
struct Format {
  const char* name;
  std::vector<std::string> samples;
  std::function<void(const std::string&)> read;
  bool safetensors = false;  ///< mutate only the header, and update its length
  bool refuses = true;       ///< false: whatever the bytes, the answer is a value
};

/// Returns the formats that this build reads. Their readers take the bytes of a file.
std::vector<Format> formats();
