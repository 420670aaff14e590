#include <fieldmark/imaging/exif.h>
#include <fieldmark/imaging/image.h>

#include "imaging/jpeg_bytes.h"
#include "support/catch.h"

using namespace fieldmark;

TEST_CASE("exif: the orientation of a JPEG file, in both orders of bytes") {
  const auto plain = encode_jpeg(Tensor<float>({8, 8, 3}, 0.5f), 80);
  CHECK(exif_orientation(plain) == 1);
  for (const bool big : {false, true})
    for (int orientation = 1; orientation <= 8; ++orientation) {
      const auto file = with_orientation(plain, orientation, big);
      CHECK(exif_orientation(file) == orientation);
      CHECK(decode_image(file, "turned").data == decode_image(plain, "plain").data);
    }
}

TEST_CASE("exif: what does not say is upright") {
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

TEST_CASE("exif: an image is turned as the orientation says") {
  // 1 2 3 above 4 5 6, two channels.
  Tensor<float> x({2, 3, 2});
  for (Index i = 0; i < x.size(); ++i)
    x[i] = static_cast<float>(i / 2 + 1) + 0.5f * static_cast<float>(i % 2);
  const std::vector<std::vector<float>> expected{{1, 2, 3, 4, 5, 6}, {3, 2, 1, 6, 5, 4}, {6, 5, 4, 3, 2, 1},
                                                 {4, 5, 6, 1, 2, 3}, {1, 4, 2, 5, 3, 6}, {4, 1, 5, 2, 6, 3},
                                                 {6, 3, 5, 2, 4, 1}, {3, 6, 2, 5, 1, 4}};
  for (int orientation = 1; orientation <= 8; ++orientation) {
    const auto y = turned(x, orientation);
    CHECK(y.shape == (orientation < 5 ? Shape{2, 3, 2} : Shape{3, 2, 2}));
    for (Index i = 0; i < y.size(); ++i)
      CHECK(y[i] == expected[static_cast<std::size_t>(orientation - 1)][static_cast<std::size_t>(i / 2)] +
                        0.5f * static_cast<float>(i % 2));
  }
}
