#include "cli/counted.h"

namespace fieldmark::cli {

std::string counted(std::int64_t count, const std::string& thing) {
  return std::to_string(count) + " " + thing + (count == 1 ? "" : "s");
}

}  // namespace fieldmark::cli
