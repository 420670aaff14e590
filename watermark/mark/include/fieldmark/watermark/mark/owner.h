#pragma once
#include <fieldmark/watermark/mark/mark.h>

#include <filesystem>
#include <optional>

namespace fieldmark::watermark {

/// Options of an owner, shared by every kind of mark and stored in OWNER.
struct OwnerOptions {
  Index bits = 16;           ///< length of a message in training, and by default, 1 to 256
  double mark_psnr = 36.5;   ///< of marks with a gain, dB, mean over novel views, 20 to 60
  Index reader_size = 160;   ///< longer side of the extractor's images, pixels, >= 32
  double reader_aspect = 1;  ///< width over height of the extractor's images, 1/4 to 4, see reader_aspect()
  std::uint64_t seed = 0;    ///< of the initial parameters
  /// Returns the size of the extractor's images: the shorter side is the multiple of 8 pixels that comes
  /// nearest to reader_aspect, at least 16.
  PatchSize patch() const;
};

/// Returns the aspect of the image part that suits the extractor: for a scene that fills its images (space
/// contracted or ndc), that of the training images, within 1/4 to 4; for an object before a plain background,
/// a square.
/// @return width over height
double reader_aspect(const nerf::RadianceField& field);

/// The owner's secret: unmarked field, mark, extractor, cells and, unless it is kept elsewhere, the key.
class Owner {
 public:
  /// @param grid  cells of the scene, or message_slots() for a mark without cells
  /// @param make  the mark, see cell_mark() and fusion_mark()
  /// @throws ValueError if an option is out of range or the grid does not suit the mark
  Owner(nerf::RadianceField base, const OwnerOptions& options, const std::optional<Key>& owner_key,
        CellGrid grid, const MarkMaker& make);

  /// Returns the owner's key. @throws ValueError if it holds none
  const Key& own_key() const;
  /// Returns bits and signs of the cells under the owner's key. @throws ValueError if it holds none
  CellCode code() const { return code(own_key()); }
  /// Returns bits and signs of the cells under another key.
  CellCode code(const Key& other) const { return mark_->code(cells, other, options_.bits); }
  /// Sets another key and another message length for the life of this object: the networks of a key-free
  /// owner serve any.
  /// @param bits  1 to most_bits()   @throws ValueError otherwise
  void set_code(const Key& other, Index bits);
  /// Returns the longest message: one bit per cell; the trained length for a mark without cells.
  Index most_bits() const { return mark_->has_cells() ? cells.count() : options_.bits; }
  /// True if the networks were trained under fresh random codes and so know no key. Only then does the bound
  /// of keyed_p_value() provably hold for the owner's own key. False for owners of version 0.1.
  bool key_free() const { return key_free_; }
  /// The mark: how a message changes colours, and how an image is read.
  const Mark& mark() const { return *mark_; }
  /// Returns the colours of the marked field, see Mark::recolour(). The owner must outlive them.
  nerf::Renderer::Recolour marking(std::vector<std::int8_t> signs) const {
    return mark_->recolour(*this, std::move(signs));
  }

  /// Scales the mark to another PSNR without training, for the life of this object.
  /// @param mark_psnr  dB, 20 to 60   @throws ValueError if it is outside, or the mark has no gain
  void set_mark_psnr(double mark_psnr);

  /// Writes an OWNER. @throws IoError
  void save(const std::filesystem::path& path) const;
  /// Reads an OWNER. @throws IoError if the file is missing, foreign, of another kind, or its tensors do not
  /// fit its configuration
  static Owner load(const std::filesystem::path& path);

  /// The options given to the constructor, as changed by set_mark_psnr() and set_code().
  const OwnerOptions& options() const { return options_; }

  nerf::RadianceField field;  ///< unmarked
  std::optional<Key> key;     ///< deals the cells; empty if it is kept elsewhere
  CellGrid cells;             ///< or slots, see message_slots()
  ParamStore<float> params;   ///< of the mark and of its extractor
  double gain = 0;            ///< g, set by calibration; stays 0 for a mark without a gain

 private:
  OwnerOptions options_;
  bool key_free_ = true;
  std::shared_ptr<const Mark> mark_;  // immutable, so copies of an owner share it
};

}  // namespace fieldmark::watermark
