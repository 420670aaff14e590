#pragma once
#include <fieldmark/engine/tensor.h>
#include <fieldmark/watermark/evidence/evidence_record.h>

#include <string>
#include <vector>

namespace fieldmark::cli {

/// Thumbnails of the images for a page, see thumbnail().
struct PageImages {
  std::vector<std::string> images{};    ///< of the suspect images, in the record's order
  std::vector<std::string> controls{};  ///< of the first image of each control
};

/// Returns a small copy of an image as a JPEG in a data: URL.
/// @param rgb  [H, W, 3]
std::string thumbnail(const Tensor<float>& rgb);

/// Formats a self-contained HTML page: the verdict in plain words, its limits, every figure, plots and
/// images. It loads nothing and runs no scripts. Equal records give equal pages.
std::string evidence_page(const watermark::EvidenceRecord& record, const watermark::PublicKey& signer,
                          const PageImages& images);

}  // namespace fieldmark::cli
