#include "cli/fingerprints.h"

#include <fieldmark/core/digest.h>

#include <algorithm>

namespace fieldmark::cli {
namespace {

constexpr const char* kKeyTensor = "key";  // of an OWNER file

std::string sorted_lines_sha256(std::vector<std::string> lines) {
  std::ranges::sort(lines);
  std::string text;
  for (const std::string& line : lines) text += line + "\n";
  return sha256_hex(text);
}

}  // namespace

std::string networks_sha256(const SafetensorsFile& owner) {
  std::vector<std::string> lines;
  for (const auto& tensor : owner.tensors)
    if (tensor.name != kKeyTensor)
      lines.push_back(tensor.name + " " + tensor.dtype + " " + tensor.shape.str() + " " +
                      sha256_hex(tensor.data));
  return sorted_lines_sha256(std::move(lines));
}

std::string recipients_sha256(const std::vector<std::string>& names) { return sorted_lines_sha256(names); }

}  // namespace fieldmark::cli
