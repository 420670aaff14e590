#include "webp_file.h"

#include <fieldmark/core/error.h>
#include <fieldmark/imaging/exif.h>
#include <fieldmark/imaging/image.h>
#include <fieldmark/imaging/image_format.h>

#include <algorithm>
#include <cmath>

#include "imaging/jpeg_bytes.h"
#include "imaging/media_samples.h"
#include "support/catch.h"
#include "support/library.h"
#include "support/random.h"
#include "support/worst.h"

using namespace fieldmark;

namespace {
bool has_webp() { return library_or_skip(is_built_in(ImageFormat::webp), "the test of WebP", "libwebp-dev"); }
double worst(const Tensor<float>& a, const Tensor<float>& b) {
  double most = 0;
  for (Index i = 0; i < a.size(); ++i) raise_to(most, std::abs(static_cast<double>(a[i] - b[i])));
  return most;
}
void put(std::vector<std::byte>& bytes, std::size_t value, int size) {
  for (int i = 0; i < size; ++i) bytes.push_back(static_cast<std::byte>(value >> 8 * i));
}
// Returns the file in extended form, with an EXIF chunk.
std::vector<std::byte> with_exif(const std::vector<std::byte>& webp, const std::vector<std::byte>& exif) {
  std::vector<std::byte> out = bytes_from({'R', 'I', 'F', 'F'});
  put(out, 4 + 18 + webp.size() - 12 + 8 + exif.size() + exif.size() % 2, 4);
  append(out,
         bytes_from({'W', 'E', 'B', 'P', 'V', 'P', '8', 'X', 10, 0, 0, 0, 8, 0, 0, 0, 15, 0, 0, 7, 0, 0}));
  out.insert(out.end(), webp.begin() + 12, webp.end());
  append(out, bytes_from({'E', 'X', 'I', 'F'}));
  put(out, exif.size(), 4);
  append(out, exif);
  if (exif.size() % 2 == 1) out.push_back(std::byte{0});
  return out;
}
}  // namespace

TEST_CASE("webp_file: a round trip keeps colours, less so at lower quality") {
  if (!has_webp()) return;
  Tensor<float> plain({20, 31, 3}), x = uniform<float>({40, 33, 3}, 0, 1, 3);
  for (Index i = 0; i < plain.size(); ++i) plain[i] = static_cast<float>(i % 3 + 1) * 60.f / 255.f;
  const auto back = webp_round_trip(plain, 90);
  CHECK(back.shape == plain.shape);
  CHECK(worst(back, plain) < 5.0 / 255);
  CHECK(quantize8(back).data == back.data);
  const auto rms = [&](int quality) {
    const auto y = webp_round_trip(x, quality);
    double sum = 0;
    for (Index i = 0; i < x.size(); ++i) sum += std::pow(static_cast<double>(x[i] - y[i]), 2);
    return sum;
  };
  CHECK(rms(95) < rms(50));
  CHECK(rms(50) < rms(5));
  CHECK(encode_webp(x, 80) == encode_webp(x, 80));
}

TEST_CASE("webp_file: alpha comes back, and the name says nothing") {
  if (!has_webp()) return;
  Tensor<float> x({9, 7, 4}, 0.4f);
  for (Index i = 3; i < x.size(); i += 4) x[i] = i < 100 ? 1.f : 51.f / 255.f;
  const auto y = decode_image(encode_webp(x, 80), "x.png");
  REQUIRE(y.shape == x.shape);
  for (Index i = 3; i < x.size(); i += 4) CHECK(y[i] == x[i]);  // alpha is lossless
}

TEST_CASE("webp_file: its EXIF orientation is read") {
  if (!has_webp()) return;
  const auto webp = encode_webp(quarters(), 90);
  CHECK(exif_orientation(webp) == 1);
  const auto jpeg = with_orientation(encode_jpeg(Tensor<float>({8, 8, 3}), 50), 6, true);
  for (const bool named : {false, true}) {
    // After the markers, the length and the name: 36 bytes of TIFF.
    const auto tiff = std::span(jpeg).subspan(named ? 6 : 12, named ? 42 : 36);
    const auto file = with_exif(webp, {tiff.begin(), tiff.end()});
    CHECK(exif_orientation(file) == 6);
    CHECK(decode_image(file, "turned").data == decode_image(webp, "plain").data);
    for (std::size_t size = 0; size < file.size(); ++size) {
      const int found = exif_orientation(std::span(file).first(size));
      CHECK((found == 1 || found == 6));
    }
  }
}

TEST_CASE("webp_file: files that are cut, and numbers out of range, are errors") {
  if (!has_webp()) return;
  const auto webp = encode_webp(quarters(), 80);
  for (std::size_t size = 0; size < webp.size(); ++size)
    CHECK_THROWS_AS(decode_image(std::span(webp).first(size), "cut"), IoError);
  CHECK_THROWS_WITH(decode_image(std::span(webp).first(webp.size() - 9), "cut"),
                    Contains("cut: expected a PNG") && Contains("truncated"));
  auto longer = webp;
  append(longer, bytes_from({1, 2, 3}));
  CHECK(decode_image(longer, "longer").data == decode_image(webp, "whole").data);
  CHECK_THROWS_WITH(encode_webp(quarters(), 0), Contains("quality must be from 1 to 100, got 0"));
  CHECK_THROWS_AS(encode_webp(Tensor<float>({2, 2, 1}), 50), ShapeError);
  CHECK_THROWS_AS(encode_webp(Tensor<float>({1, 16384, 3}), 50), ShapeError);
}
