#include <fieldmark/core/error.h>
#include <fieldmark/core/files.h>
#include <fieldmark/imaging/image.h>
#include <fieldmark/imaging/image_format.h>

#include "imaging/jpeg_bytes.h"
#include "imaging/media_samples.h"
#include "support/catch.h"
#include "support/temporary_folder.h"

using namespace fieldmark;

namespace {
std::vector<std::byte> text(std::string_view s) {
  const auto bytes = std::as_bytes(std::span(s.data(), s.size()));
  return {bytes.begin(), bytes.end()};
}
}  // namespace

TEST_CASE("image_format: the content decides, not the name") {
  using enum ImageFormat;
  const TemporaryFolder folder;
  write_png(folder / "a.jpg", Tensor<float>({2, 2, 3}));
  CHECK(image_format(folder / "a.jpg") == png);
  CHECK(image_format(encode_jpeg(Tensor<float>({8, 8, 3}), 50)) == jpeg);
  CHECK(image_format(text("RIFF\x10\0\0\0WEBPVP8 ")) == unknown);  // the literal ends at its first 0 byte
  CHECK(image_format(text(std::string_view("RIFF\x10\0\0\0WEBPVP8 ", 16))) == webp);
  CHECK(image_format(from_base64(kAvif)) == avif);
  CHECK(image_format(from_base64(kHeic)) == heic);
  for (const auto sample : {kWebm, kMovTurned, kMovVariable, kAudio})
    CHECK(image_format(from_base64(sample)) == video);
  CHECK(image_format(text(std::string_view("\0\0\0\x08wide\0\0\0\0mdat", 16))) == video);
  // With a general major brand, the compatible brands decide.
  const std::string_view head(
      "\0\0\0\x18"
      "ftypmif1\0\0\0\0mif1",
      20);
  CHECK(image_format(text(std::string(head) + "avif")) == avif);
  CHECK(image_format(text(std::string(head) + "heic")) == heic);
  CHECK(image_format(std::vector<std::byte>{}) == unknown);
  CHECK(image_format(text("GIF89a")) == unknown);
  CHECK_THROWS_WITH(image_format(folder / "none"), Contains("open failed"));
}

TEST_CASE("image_format: extensions in any case") {
  for (const char* name : {"a.png", "a.b.JPG", "x.Jpeg", "x.webp", "x.AVIF", "x.heic", "x.HIF", "dir/x.jfif"})
    CHECK(has_image_extension(name));
  for (const char* name : {"a.gif", "png", ".png", "a.png.txt", "a", "clip.mp4"})
    CHECK(!has_image_extension(name));
}

TEST_CASE("image_format: a format without its library is named with its package") {
  const std::pair<ImageFormat, std::string> packages[] = {{ImageFormat::webp, "libwebp-dev"},
                                                          {ImageFormat::avif, "libavif-dev"},
                                                          {ImageFormat::heic, "libheif-dev"}};
  const std::vector<std::byte> files[] = {text(std::string_view("RIFF\x10\0\0\0WEBPVP8 ", 16)),
                                          from_base64(kAvif), from_base64(kHeic)};
  for (std::size_t i = 0; i < 3; ++i) {
    const auto& [format, package] = packages[i];
    if (is_built_in(format)) continue;
    CHECK_THROWS_WITH(decode_image(files[i], "x"),
                      Contains(std::string(format_name(format)) + " images need") &&
                          Contains("install " + package + " and build again"));
  }
  CHECK(is_built_in(ImageFormat::png));
  CHECK(!is_built_in(ImageFormat::video));
  CHECK(missing_library("WebP images", "libwebp", "libwebp-dev") ==
        "WebP images need libwebp, which this build of Fieldmark lacks; install libwebp-dev and build again");
}

TEST_CASE("image_format: a video in the place of an image, and an unknown file") {
  CHECK_THROWS_WITH(
      decode_image(from_base64(kWebm), "clip.webm"),
      Contains("clip.webm: expected a PNG, JPEG, WebP, AVIF or HEIC image") && Contains("a video"));
  CHECK_THROWS_WITH(decode_image(text("GIF89a"), "a.gif"), Contains("unknown image type"));
}

TEST_CASE("image_format: data behind the end and a missing end are told") {
  const auto jpeg = encode_jpeg(Tensor<float>({8, 8, 3}, 0.5f), 80);
  const TemporaryFolder folder;
  write_png(folder / "a.png", Tensor<float>({8, 8, 3}, 0.5f));
  const auto png = read_bytes(folder / "a.png");
  const std::pair<const char*, std::vector<std::byte>> files[] = {{"JPEG", jpeg}, {"PNG", png}};
  for (const auto& [name, file] : files) {
    CHECK(image_oddity(file).empty());
    const std::size_t end = name == std::string("PNG") ? 12 : 2;
    CHECK(image_oddity(std::span(file).first(file.size() - end)) ==
          "the " + std::string(name) + " file has no end marker; its image is complete");
    auto phone = file;
    append(phone, bytes_from({0, 0, 0, 24, 'f', 't', 'y', 'p', 0xff, 0xda, 1}));
    CHECK(image_oddity(phone) == "11 bytes behind the end of the " + std::string(name) + " file are ignored");
  }
  CHECK(image_oddity(text("GIF89a")).empty());
}
