#pragma once
#include <fieldmark/watermark/picture_reader.h>

#include <string>
#include <vector>

namespace fieldmark::cli {

class Context;

/// What the extractor sees in one picture.
struct PictureEvidence {
  std::string image;
  std::vector<double> cells;  ///< sign evidence S_c
  std::string sha256{};       ///< of the file's bytes
  Index width = 0;            ///< pixels
  Index height = 0;           ///< pixels
};

/// Reads the pictures that IMAGE|DIR... names. @throws IoError naming the picture that cannot be read
std::vector<PictureEvidence> read_pictures(const watermark::Owner& owner,
                                           const std::vector<std::string>& paths, Context& context);

/// Of all pictures together: views of one field are not independent trials, so their evidence is added.
std::vector<double> total_evidence(const std::vector<PictureEvidence>& pictures);

}  // namespace fieldmark::cli
