#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace fieldmark {

/// One marker of a JPEG file and what stands behind it.
struct JpegSegment {
  int marker = 0;                        ///< second byte of the marker: 0xd8 to 0xfe
  std::span<const std::byte> payload{};  ///< behind the length; empty where the marker has none
};

/// The markers of a JPEG file in order, and where the image ends.
/// Source: ITU-T T.81, annex B.
struct JpegSegments {
  std::vector<JpegSegment> segments{};
  std::size_t end = 0;    ///< first byte behind the end marker; the size of the file where there is none
  bool complete = false;  ///< there is an end marker

  /// Whether every coefficient of every component has been sent to its last bit, as far as scan headers tell:
  /// a progressive file sends them in turns.
  bool sends_every_coefficient() const;
};

/// Whether the bytes begin as a JPEG file does.
bool is_jpeg(std::span<const std::byte> bytes);

/// Steps through a JPEG file, never beyond its bytes, to its end marker, to a segment longer than what is
/// left, or to the end. @param bytes  see is_jpeg(); they must outlive the result
JpegSegments jpeg_segments(std::span<const std::byte> bytes);

}  // namespace fieldmark
