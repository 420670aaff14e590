#pragma once
#include <fieldmark/watermark/picture_reader.h>

#include <filesystem>
#include <vector>

#include "cli/context.h"

namespace fieldmark::cli {

/// The evidence of some pictures, one by one and added up.
struct Readings {
  std::vector<std::filesystem::path> pictures;
  std::vector<std::vector<double>> each;  ///< [pictures][cells]
  std::vector<double> sum;                ///< [cells]
};

/// Reads IMAGE|DIR... with the owner's extractor, with progress. @throws IoError as list_pictures() and
/// read_image()
Readings read_pictures(const watermark::Owner& owner, const std::vector<std::string>& paths,
                       Context& context);

}  // namespace fieldmark::cli
