#pragma once
#include <fieldmark/engine/tensor.h>
#include <fieldmark/watermark/evidence_record.h>

#include <string>
#include <vector>

namespace fieldmark::cli {

/// Small copies of the pictures for a page, see thumbnail().
struct PagePictures {
  std::vector<std::string> pictures{};  ///< of the pictures in question, in the record's order
  std::vector<std::string> controls{};  ///< of the first picture of each control
};

/// A small copy of a picture as a JPEG inside a data: address.
/// @param rgb  [H, W, 3]
std::string thumbnail(const Tensor<float>& rgb);

/// A page for people: the verdict in plain words, what it does not prove, every figure, plots and pictures.
/// It stands by itself, loads nothing and runs no scripts. Equal records give equal pages.
std::string evidence_page(const watermark::EvidenceRecord& record, const watermark::PublicKey& signer,
                          const PagePictures& pictures);

}  // namespace fieldmark::cli
