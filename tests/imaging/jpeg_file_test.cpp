#include <fieldmark/imaging/image.h>
#include <fieldmark/imaging/jpeg_file.h>

#include "imaging/jpeg_bytes.h"
#include "support/catch.h"

using namespace fieldmark;

TEST_CASE("jpeg_file: the orientation of a JPEG file, in both orders of bytes") {
  const auto plain = encode_jpeg(Tensor<float>({8, 8, 3}, 0.5f), 80);
  CHECK(exif_orientation(plain) == 1);
  for (const bool big : {false, true})
    for (int orientation = 1; orientation <= 8; ++orientation) {
      const auto file = with_orientation(plain, orientation, big);
      CHECK(exif_orientation(file) == orientation);
      CHECK(decode_image(file, "turned").data == decode_image(plain, "plain").data);
    }
}

TEST_CASE("jpeg_file: what does not say is upright") {
  const auto plain = encode_jpeg(Tensor<float>({8, 8, 3}, 0.5f), 80);
  for (const int orientation : {0, 9, 255})
    CHECK(exif_orientation(with_orientation(plain, orientation, true)) == 1);
  CHECK(exif_orientation({}) == 1);
  CHECK(exif_orientation(bytes_from({0x89, 'P', 'N', 'G'})) == 1);
  const auto six = with_orientation(plain, 6, false);
  const std::size_t said = 12 + 8 + 2 + 12 + 10;  // behind segment and name: TIFF header, count, entry, value
  for (std::size_t size = 0; size < six.size(); ++size) {
    const int found = exif_orientation(std::span(six).first(size));
    CHECK((found == 1 || found == 6));
    if (size < said) CHECK(found == 1);
  }
  auto far = six;
  far[12 + 4] = far[12 + 5] = far[12 + 6] = far[12 + 7] =
      std::byte{0xff};  // the directory lies beyond the end
  CHECK(exif_orientation(far) == 1);
}

TEST_CASE("jpeg_file: data behind the end and a missing end are told") {
  const auto jpeg = encode_jpeg(Tensor<float>({8, 8, 3}, 0.5f), 80);
  CHECK(jpeg_oddity(jpeg).empty());
  CHECK(jpeg_oddity(bytes_from({0x89, 'P', 'N', 'G'})).empty());
  CHECK(jpeg_oddity(std::span(jpeg).first(jpeg.size() - 2)) ==
        "the JPEG file has no end marker; its image is complete");
  auto phone = jpeg;
  append(phone, bytes_from({0, 0, 0, 24, 'f', 't', 'y', 'p', 0xff, 0xda, 1}));
  CHECK(jpeg_oddity(phone) == "11 bytes behind the end of the JPEG file are ignored");
}
