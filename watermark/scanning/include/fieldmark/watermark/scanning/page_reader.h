#pragma once
#include <fieldmark/watermark/reading/informed_reader.h>
#include <fieldmark/watermark/scanning/image_blocks.h>
#include <fieldmark/watermark/scanning/object_search.h>

#include <optional>
#include <vector>

namespace fieldmark::watermark {

/// The reading of a part of an image.
struct PartReading {
  PixelBox box{};  ///< of the part in the image; that of an object may reach beyond it
  /// Of the part alone, by informed detection. Its camera is of the part as it was read: with a margin, and
  /// for an object reduced with the image to a longer side of at most 512 pixels.
  ImageReading reading;
};

/// The reading of an image and of the parts that show the field.
struct PageReading {
  /// Weight of blind evidence where other images may have been found.
  static constexpr double kBlindWeight = 0.25;
  ImageReading whole;                   ///< of the whole image
  std::vector<PartReading> parts = {};  ///< that agree with the field; empty if the whole image counts
  /// Evidence of the detection chosen, [cells]: of the whole image, or the sum over all parts, each with the
  /// power of the whole image's blind evidence, so that a small part counts no less than an image in which
  /// nothing was found. Blind evidence counts a quarter, so that such images hardly dilute others.
  std::vector<double> evidence() const;
  /// Informed if the image or a part of it agrees with the field.
  ReadingKind chosen() const { return parts.empty() ? whole.chosen : ReadingKind::informed; }
  /// Chooses informed detection of the whole image if its evidence is there and no part agrees, whatever the
  /// agreement.
  void force_informed() {
    if (parts.empty() && !whole.informed.evidence.empty()) whole.chosen = ReadingKind::informed;
  }
  /// Largest agreement of the image or of a part.
  double agreement() const;
};

/// Detection that also reads views on a page, in a collage, and objects in other surroundings. The first of
/// these that agrees with the field counts, with one exception: an image or a block that gaps divide and that
/// agrees by less than 0.98 is replaced by its parts if one of them agrees better by more than 0.02 and is
/// mirrored where the whole is not, or the reverse.
///   - the whole image, as by InformedReader, unless one side is more than 8 times the other;
///   - its blocks, which plain gaps separate (see image_blocks()), the largest first, and the parts of blocks
///     that do not agree; all blocks that agree are added up;
///   - for an object, the places where the image looks most like a render or a quarter of one (see
///     ObjectSearch). There, InformedReader::read_near() looks at the pixels inside the outline alone, and
///     the object counts as found at an agreement of 0.9, a quarter at 0.94. Parts of 48 to 59 pixels need
///     0.97, and give way to a larger one.
/// The choice depends on agreement alone and on neither key nor message, so the evidence may be tested
/// against any.
class PageReader {
 public:
  /// Shorter side of the smallest block, pixels.
  static constexpr Index kLeastSide = 64;
  /// Most blocks read in an image; the smallest of a longer page are left out.
  static constexpr Index kMostBlocks = 24;
  /// @param owner  of preset fast; must outlive the reader
  /// @param objects  of the search for an object, made for the first image that needs it
  /// @throws ValueError as InformedReader, and if an option of a search is out of range
  explicit PageReader(const Owner& owner, const CameraSearchOptions& search = {},
                      const ObjectSearchOptions& objects = {});
  /// Reads an image.
  /// @param image  as BlindReader::evidence()   @param informed_too  true to compute informed evidence of the
  /// whole image even if it does not agree with the field
  /// @throws ShapeError, ValueError as BlindReader::evidence()
  PageReading read(const Tensor<float>& image, bool informed_too = false);

 private:
  std::vector<PartReading> read_blocks(const Tensor<float>& rgb, const ImageBlocks& found,
                                       const std::vector<ImageBlock>& first);
  std::vector<PartReading> read_object(const Tensor<float>& whole);

  const Owner& owner_;
  InformedReader reader_;
  ObjectSearchOptions object_options_;
  std::optional<ObjectSearch> objects_ = {};  // from the first image that needs it
};

}  // namespace fieldmark::watermark
