#include "jpeg_turbo.h"

#include <fieldmark/core/error.h>
#include <fieldmark/imaging/image.h>

#include <cmath>

#include "imaging/media_samples.h"
#include "support/catch.h"
#include "support/library.h"

using namespace fieldmark;

namespace {
bool has_jpeg() {
  if (!has_jpeg_turbo())
    CHECK_THROWS_WITH(encode_jpeg(quarters(), 95), Contains("install libjpeg62-turbo-dev and build again"));
  return library_or_skip(has_jpeg_turbo(), "the test of libjpeg-turbo", "libjpeg62-turbo-dev");
}
// Returns the luma sampling: the byte after the first component's number in SOF0.
int sampling(const std::vector<std::byte>& file) {
  for (std::size_t i = 0; i + 11 < file.size(); ++i)
    if (file[i] == std::byte{0xff} && file[i + 1] == std::byte{0xc0})
      return std::to_integer<int>(file[i + 11]);
  return 0;
}
double rms(const Tensor<float>& a, const Tensor<float>& b) {
  double sum = 0;
  for (Index i = 0; i < a.size(); ++i) sum += std::pow(static_cast<double>(a[i] - b[i]), 2);
  return std::sqrt(sum / static_cast<double>(a.size()));
}
// Stripes of one pixel, almost in chroma alone.
Tensor<float> stripes() {
  Tensor<float> x({32, 32, 3});
  for (Index i = 0; i < x.size(); ++i) x[i] = i / 3 % 2 == i % 3 % 2 ? 0.3f : 0.6f;
  return x;
}
}  // namespace

TEST_CASE("jpeg_turbo: chroma is halved or full at every quality") {
  if (!has_jpeg()) return;
  for (const int quality : {91, 95, 100}) CHECK(sampling(encode_jpeg(stripes(), quality)) == 0x22);
  for (const int quality : {1, 50, 100})
    CHECK(sampling(encode_jpeg(stripes(), quality, Chroma::full)) == 0x11);
  CHECK(rms(stripes(), jpeg_round_trip(stripes(), 100, Chroma::full)) < 0.01);
  CHECK(rms(stripes(), jpeg_round_trip(stripes(), 100)) > 0.1);
}

TEST_CASE("jpeg_turbo: quality 50 has the tables of annex K, and grey has one component") {
  if (!has_jpeg()) return;
  const auto file = encode_jpeg(quarters(), 50, Chroma::full);
  std::size_t table = 0;
  while (!(file[table] == std::byte{0xff} && file[table + 1] == std::byte{0xdb})) ++table;
  const int first[] = {16, 11, 12, 14, 12, 10, 16, 14};  // in zigzag order
  for (std::size_t k = 0; k < 8; ++k) CHECK(std::to_integer<int>(file[table + 5 + k]) == first[k]);
  const auto grey = jpeg_round_trip(Tensor<float>({17, 9, 1}, 0.4f), 95);
  CHECK(grey.shape == Shape{17, 9, 1});
  CHECK(std::abs(grey[0] - 0.4f) < 1.0f / 255);
}
