#include <fieldmark/core/error.h>
#include <fieldmark/core/files.h>
#include <fieldmark/imaging/image.h>

#include <cmath>
#include <limits>
#include <numeric>
#include <string>
#include <vector>

#include "imaging/jpeg_bytes.h"
#include "support/catch.h"
#include "support/random.h"
#include "support/temporary_folder.h"

using namespace fieldmark;

namespace {

double rms(const Tensor<float>& a, const Tensor<float>& b, Index channel) {
  double sum = 0;
  for (Index i = channel; i < a.size(); i += a.shape[2]) sum += std::pow(static_cast<double>(a[i] - b[i]), 2);
  return std::sqrt(sum * static_cast<double>(a.shape[2]) / static_cast<double>(a.size()));
}
/// Returns smooth colours, like those of a training image.
Tensor<float> gradient(Index height, Index width, Index channels) {
  Tensor<float> x({height, width, channels});
  for (Index i = 0; i < x.size(); ++i) {
    const double c = static_cast<double>(i % channels), u = static_cast<double>(i / channels % width);
    const double v = static_cast<double>(i / channels / width);
    x[i] = static_cast<float>(0.5 + 0.4 * std::sin(0.05 * u + 0.04 * v + c));
  }
  return x;
}

}  // namespace

TEST_CASE("image: every byte and channel count survives a PNG file") {
  const TemporaryFolder folder;
  for (Index channels : {1, 2, 3, 4}) {
    Tensor<float> x({16, 17, channels});
    for (Index i = 0; i < x.size(); ++i) x[i] = static_cast<float>(i % 256) / 255.0f;
    write_png(folder / "a.png", x);
    const auto y = read_image(folder / "a.png");
    CHECK(y.shape == x.shape);
    CHECK(y.data == x.data);
  }
  write_png(folder / "a.png", Tensor<float>({1, 1, 3}, 0.5f));
  CHECK(read_image(folder / "a.png").data == std::vector<float>(3, 128 / 255.0f));
  CHECK(folder.entries() == 1);
}

// Two grey pixels, 0x12 and 0xef, in an uncompressed deflate block, built with Python's zlib.
TEST_CASE("image: a PNG that another program wrote") {
  const auto png = bytes_from(
      {0x89, 0x50, 0x4e, 0x47, 0xd,  0xa,  0x1a, 0xa, 0, 0,    0,    0xd,  0x49, 0x48, 0x44, 0x52, 0,    0,
       0,    2,    0,    0,    0,    1,    8,    0,   0, 0,    0,    0xd1, 0x49, 0x20, 0x56, 0,    0,    0,
       0xe,  0x49, 0x44, 0x41, 0x54, 0x78, 1,    1,   3, 0,    0xfc, 0xff, 0,    0x12, 0xef, 1,    0x16, 1,
       2,    0x6c, 0xde, 0x70, 0x65, 0,    0,    0,   0, 0x49, 0x45, 0x4e, 0x44, 0xae, 0x42, 0x60, 0x82});
  const auto x = decode_image(png, "two.png");
  CHECK(x.shape == Shape{1, 2, 1});
  CHECK(x.data == std::vector<float>{0x12 / 255.0f, 0xef / 255.0f});
}

TEST_CASE("image: quantising clamps, rounds half up, is idempotent, and NaN is black") {
  const float inf = std::numeric_limits<float>::infinity();
  const Tensor<float> x({8}, std::vector<float>{-1, -inf, 0, 0.49f / 255, 0.51f / 255, 254.6f / 255, 2, inf});
  CHECK(bytes_of(x) == std::vector<std::uint8_t>{0, 0, 0, 0, 1, 255, 255, 255});
  CHECK(bytes_of(Tensor<float>({1}, std::nanf(""))) == std::vector<std::uint8_t>{0});
  const auto q = quantize8(uniform<float>({1000}, -0.1, 1.1, 1));
  CHECK(quantize8(q).data == q.data);
  CHECK(q.data != quantize8(uniform<float>({1000}, -0.1, 1.1, 2)).data);
}

TEST_CASE("image: files that are no image are errors with path, size and reason") {
  const TemporaryFolder folder;
  const std::string path = (folder / "a.png").string();
  CHECK_THROWS_WITH(read_image(path), "[read] " + path + ": open failed: No such file or directory");
  write_file_atomically(path, "not an image");
  CHECK_THROWS_WITH(read_image(path),
                    "[read_image] " + path +
                        ": expected a PNG, JPEG, WebP, AVIF or HEIC image, found 12 bytes that do "
                        "not decode: unknown image type");
  write_file_atomically(path, "");
  CHECK_THROWS_WITH(read_image(path), Contains("found 0 bytes"));
  write_png(path, gradient(20, 20, 3));
  const auto png = read_bytes(path);
  const auto jpeg = encode_jpeg(gradient(20, 20, 3), 80);
  for (const auto* file : {&png, &jpeg})
    for (std::size_t size = 1; size + 16 < file->size(); ++size)
      CHECK_THROWS_AS(decode_image(std::span(*file).first(size), "cut"), IoError);
  CHECK_THROWS_WITH(decode_image(std::span(jpeg).first(jpeg.size() - 20), "cut"),
                    Contains("no end marker, truncated"));
  CHECK_THROWS_WITH(decode_image(bytes_from({0xff, 0xd8, 0xff, 0xd9}), "empty"),
                    Contains("without an image"));
}

TEST_CASE("image: a JPEG file is read without its end marker, and with other data behind it") {
  const auto x = uniform<float>({40, 33, 3}, 0, 1, 5);
  for (const int quality : {10, 90}) {
    const auto jpeg = encode_jpeg(x, quality);
    const auto whole = decode_image(jpeg, "whole");
    for (const std::size_t cut : {1u, 2u})
      CHECK(decode_image(std::span(jpeg).first(jpeg.size() - cut), "cut").data == whole.data);
    for (std::size_t cut = 8; cut < 60; ++cut)
      CHECK_THROWS_AS(decode_image(std::span(jpeg).first(jpeg.size() - cut), "cut"), IoError);
    auto video = jpeg;  // what looks like a scan, and bytes that stand for a film
    append(video, bytes_from({0xff, 0xda, 0, 0, 0, 24, 'f', 't', 'y', 'p', 0xff, 0xda, 1}));
    CHECK(decode_image(video, "phone.jpg").data == whole.data);
  }
}

TEST_CASE("image: a PNG file is read without its end chunk, and with other data behind it") {
  const TemporaryFolder folder;
  const auto x = quantize8(uniform<float>({40, 33, 3}, 0, 1, 5));
  write_png(folder / "a.png", x);
  const auto png = read_bytes(folder / "a.png");
  // The end chunk takes 12 bytes, the checksum before it takes 4.
  for (std::size_t cut = 1; cut <= 16; ++cut)
    CHECK(decode_image(std::span(png).first(png.size() - cut), "cut").data == x.data);
  for (std::size_t cut = 17; cut < 80; ++cut)
    CHECK_THROWS_WITH(decode_image(std::span(png).first(png.size() - cut), "cut"),
                      Contains("no end marker, truncated"));
  auto junk = png;
  append(junk, bytes_from({0, 0, 0, 24, 'f', 't', 'y', 'p', 0xff}));
  CHECK(decode_image(junk, "junk").data == x.data);
}

TEST_CASE("image: a header alone does not take gigabytes") {
  auto jpeg = encode_jpeg(Tensor<float>({8, 8, 3}, 0.5f), 80);
  for (std::size_t i = 0; i + 8 < jpeg.size(); ++i)
    if (jpeg[i] == std::byte{0xff} && jpeg[i + 1] == std::byte{0xc0})
      for (const std::size_t k : {5, 7}) jpeg[i + k] = std::byte{0x40};  // height and width of 16384 and more
  CHECK_THROWS_WITH(decode_image(jpeg, "wide"),
                    Contains("wide: expected") && Contains("16392 x 16392 pixels; at most"));
}

// Values 0x1234 and 0xfffe, built with Python's zlib.
TEST_CASE("image: a PNG of 16 bits keeps both bytes") {
  const auto x = decode_image(
      bytes_from({0x89, 0x50, 0x4e, 0x47, 0xd,  0xa,  0x1a, 0xa,  0,    0,    0,    0xd,  0x49, 0x48, 0x44,
                  0x52, 0,    0,    0,    2,    0,    0,    0,    1,    0x10, 0,    0,    0,    0,    0x81,
                  0xd9, 0xfc, 0x15, 0,    0,    0,    0x10, 0x49, 0x44, 0x41, 0x54, 0x78, 1,    1,    5,
                  0,    0xfa, 0xff, 0,    0x12, 0x34, 0xff, 0xfe, 3,    0xe5, 2,    0x44, 0x9a, 0xdd, 0xcf,
                  0xc,  0,    0,    0,    0,    0x49, 0x45, 0x4e, 0x44, 0xae, 0x42, 0x60, 0x82}),
      "deep.png");
  CHECK(x.shape == Shape{1, 2, 1});
  CHECK(x.data == std::vector<float>{0x1234 / 65535.0f, 0xfffe / 65535.0f});
}

TEST_CASE("image: shapes that no file can hold are errors") {
  CHECK_THROWS_WITH(write_png("/nowhere/a.png", Tensor<float>({2, 2, 5})),
                    Contains("channels from 1 to 4") && Contains("got shape [2, 2, 5]"));
  CHECK_THROWS_AS(write_png("/nowhere/a.png", Tensor<float>({2, 2})), ShapeError);
  CHECK_THROWS_AS(write_png("/nowhere/a.png", Tensor<float>({0, 2, 3})), ShapeError);
  CHECK_THROWS_WITH(write_png("/nowhere/a.png", Tensor<float>({1, 1, 3})),
                    Contains("[write] /nowhere/a.png"));
  const Tensor<float> x({2, 2, 3});
  CHECK_THROWS_WITH(encode_jpeg(x, 101), Contains("quality must be from 1 to 100") && Contains("got 101"));
  CHECK_THROWS_AS(encode_jpeg(x, 0), ValueError);
  CHECK_THROWS_WITH(encode_jpeg(Tensor<float>({2, 2, 4}), 50), Contains("channels must be 1 or 3"));
}

TEST_CASE("image: JPEG has 4:2:0 chroma and the standard tables at quality 50") {
  const auto file = encode_jpeg(gradient(24, 40, 3), 50);
  auto byte = [&](std::size_t i) { return static_cast<int>(file[i]); };
  // SOI and APP0 take 20 bytes, then DQT: marker, length, table 0 in zigzag order.
  CHECK((byte(20) == 0xff && byte(21) == 0xdb));
  CHECK((byte(25) == 16 && byte(26) == 11 && byte(27) == 12 && byte(88) == 99));
  // SOF0 holds the size, and sampling 2 x 2 for luminance, 1 x 1 for both chroma components.
  const std::size_t sof = 20 + 2 + 132;
  CHECK((byte(sof) == 0xff && byte(sof + 1) == 0xc0));
  CHECK((byte(sof + 6) == 24 && byte(sof + 8) == 40));
  CHECK((byte(sof + 11) == 0x22 && byte(sof + 14) == 0x11 && byte(sof + 17) == 0x11));
}

TEST_CASE("image: a JPEG round trip keeps smooth images, less so at lower quality, any size") {
  for (const Shape& s : {Shape{1, 1, 3}, Shape{17, 33, 3}, Shape{64, 48, 1}, Shape{64, 48, 3}}) {
    const auto x = gradient(s[0], s[1], s[2]);
    const auto y = jpeg_round_trip(x, 90);
    CHECK(y.shape == s);
    for (Index c = 0; c < s[2]; ++c) CHECK(rms(x, y, c) < 0.02);
    CHECK(quantize8(y).data == y.data);
  }
  const auto x = uniform<float>({64, 64, 3}, 0, 1, 1);
  CHECK(rms(x, jpeg_round_trip(x, 90), 1) < rms(x, jpeg_round_trip(x, 50), 1));
  CHECK(rms(x, jpeg_round_trip(x, 50), 1) < rms(x, jpeg_round_trip(x, 10), 1));
}

TEST_CASE("image: a contact sheet places images in reading order") {
  const std::vector<Tensor<float>> images{Tensor<float>({2, 1, 1}, 0.1f), Tensor<float>({1, 2, 1}, 0.2f),
                                          Tensor<float>({1, 1, 1}, 0.3f)};
  const auto sheet = tile(images, 2, 1, 0.5f);
  CHECK(sheet.shape == Shape{5, 5, 1});
  CHECK(sheet.data == std::vector<float>{0.1f, 0.5f, 0.5f, 0.2f, 0.2f, 0.1f, 0.5f, 0.5f, 0.5f,
                                         0.5f, 0.5f, 0.5f, 0.5f, 0.5f, 0.5f, 0.3f, 0.5f, 0.5f,
                                         0.5f, 0.5f, 0.5f, 0.5f, 0.5f, 0.5f, 0.5f});
  CHECK(tile(std::span(images).first(1), 8, 3).shape == Shape{2, 1, 1});
  CHECK_THROWS_WITH(tile({}, 1, 0), "[tile] images must be at least one, got 0");
  CHECK_THROWS_AS(tile(images, 0, 0), ValueError);
  CHECK_THROWS_AS(tile(images, 1, -1), ValueError);
  const std::vector<Tensor<float>> mixed{Tensor<float>({1, 1, 1}), Tensor<float>({1, 1, 3})};
  CHECK_THROWS_WITH(tile(mixed, 2, 0), Contains("[paste] image: axis 2 must be 1"));
  Tensor<float> canvas({2, 2, 1});
  CHECK_THROWS_WITH(paste(canvas, Tensor<float>({2, 1, 1}), 1, 0),
                    "[paste] image: must fit into the canvas [2, 2, 1] at (1, 0), got shape [2, 1, 1]");
}
