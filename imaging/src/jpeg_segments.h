#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace fieldmark {

/// A marker of a JPEG file and its payload.
struct JpegSegment {
  int marker = 0;                        ///< second byte of the marker: 0xd8 to 0xfe
  std::span<const std::byte> payload{};  ///< after the length; empty if the marker has none
};

/// The markers of a JPEG file in order, and the end of the image.
/// Source: ITU-T T.81, annex B.
struct JpegSegments {
  std::vector<JpegSegment> segments{};
  std::size_t end = 0;    ///< first byte after the end marker; the size of the file if there is none
  bool complete = false;  ///< true if there is an end marker

  /// True if every coefficient of every component has been sent to its last bit, according to the scan
  /// headers. Progressive files spread them over several scans.
  bool sends_every_coefficient() const;
  /// True if every scan comes after the Huffman and quantisation tables that its components name. stb_image
  /// decodes with whatever memory holds in place of a missing one.
  bool defines_tables() const;
};

/// True if the bytes start with the signature of JPEG.
bool is_jpeg(std::span<const std::byte> bytes);

/// Parses the markers of a JPEG file up to its end marker, to a segment longer than the remaining bytes, or
/// to the end. Never reads beyond the bytes. @param bytes  see is_jpeg(); must outlive the result
JpegSegments jpeg_segments(std::span<const std::byte> bytes);

/// True if no Huffman table of a JPEG file has more than 255 symbols, wherever a decoder may meet one up to
/// the end marker, also in a segment longer than the remaining bytes. stb_image writes beyond its arrays for
/// 257 symbols and takes the last of 256 for a code that its short table lacks. No encoder needs as many: an
/// AC table of 8-bit images has at most 176.
bool huffman_tables_fit(std::span<const std::byte> bytes);

}  // namespace fieldmark
