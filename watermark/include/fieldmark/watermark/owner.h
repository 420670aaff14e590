#pragma once
#include <fieldmark/extractor/dense_extractor.h>
#include <fieldmark/nerf/renderer.h>
#include <fieldmark/watermark/cell_code.h>
#include <fieldmark/watermark/cell_grid.h>
#include <fieldmark/watermark/mark_network.h>

namespace fieldmark::watermark {

struct OwnerOptions {
  Index bits = 16;  ///< length of a message, 1 to 256
  double strength =
      36.5;          ///< PSNR of marked against unmarked on the object, dB, mean over near views, 20 to 60
  Index cells = 16;  ///< per axis of the field's cube, see CellGrid
  Index reader_size = 200;  ///< side of the square in which the extractor sees the object, pixels, >= 32
  MarkNetworkOptions mark;
  Index base_channels = 32;  ///< of the extractor, see DenseExtractorOptions
  std::uint64_t seed = 0;
};

/// Everything the owner keeps secret: the unmarked field, the mark's networks, the extractor, the cells and
/// the key.
class Owner {
 public:
  Owner(nerf::RadianceField field, const OwnerOptions& options, const Key& key, CellGrid cells);

  /// Which bits and signs the cells carry under the owner's key, or under another.
  CellCode code() const { return code(key); }
  CellCode code(const Key& other) const;

  /// Adds the residual g s(x) P(x, c) to colours, which stay in [0, 1]: the marked field of one message, not
  /// yet baked.
  /// @param signs  of the cells, see cell_signs()   @return a function for Renderer::set_recolour; this must
  /// outlive it
  nerf::Renderer::Recolour marking(std::vector<std::int8_t> signs) const;

  /// Writes an OWNER. @throws IoError
  void save(const std::filesystem::path& path) const;
  /// @throws IoError if the file is missing, foreign, of another kind, or its tensors do not fit its
  /// configuration
  static Owner load(const std::filesystem::path& path);

  const OwnerOptions& options() const { return options_; }

  nerf::RadianceField field;
  Key key;
  CellGrid cells;
  ParamStore<float> params;  ///< mark network and extractor
  MarkNetwork<float> mark;
  extractor::DenseExtractor<float> reader;
  double gain = 0;  ///< g

 private:
  OwnerOptions options_;
};

}  // namespace fieldmark::watermark
