#include "jpeg_segments.h"

#include <fieldmark/imaging/image.h>

#include "imaging/jpeg_bytes.h"
#include "support/catch.h"

using namespace fieldmark;

namespace {
// Returns a frame with one component, number 7.
std::vector<std::byte> head(int frame) {
  return bytes_from({0xff, 0xd8, 0xff, frame, 0, 11, 8, 0, 8, 0, 8, 1, 7, 0x11, 0});
}
// Returns a scan of that component: coefficients first to last, to a bit.
std::vector<std::byte> scan(int first, int last, int bit) {
  return bytes_from({0xff, 0xda, 0, 8, 1, 7, 0, first, last, bit, 0x12, 0xff, 0, 0x34});
}
}  // namespace

TEST_CASE("jpeg_segments: markers in order, to the end marker and no further") {
  auto file = encode_jpeg(Tensor<float>({20, 20, 3}, 0.4f), 80);
  const std::size_t size = file.size();
  append(file, bytes_from({0, 1, 0xff, 0xda, 0xff, 0xd9, 2}));
  const auto found = jpeg_segments(file);
  CHECK(is_jpeg(file));
  CHECK(found.complete);
  CHECK(found.end == size);
  CHECK(found.segments.front().marker == 0xe0);
  CHECK(found.segments.front().payload.size() == 14);
  CHECK(found.segments.back().marker == 0xda);
  CHECK(found.sends_every_coefficient());
  CHECK(!is_jpeg(bytes_from({0xff})));
  CHECK(!is_jpeg(bytes_from({0x89, 0x50})));
}

TEST_CASE("jpeg_segments: fill bytes, stuffed bytes, restarts and padding are no markers") {
  auto file = head(0xc0);
  append(file, bytes_from({0, 0xff}));  // padding, then a marker with a fill byte
  append(file, scan(0, 63, 0));
  append(file, bytes_from({0xff, 0xd0, 0x56, 0xff, 0, 0xff, 0xd7, 0xff, 0xff, 0xd9}));
  const auto found = jpeg_segments(file);
  REQUIRE(found.segments.size() == 2);
  CHECK(found.complete);
  CHECK(found.end == file.size());
  for (std::size_t size = 0; size < file.size(); ++size)
    CHECK(!jpeg_segments(std::span(file).first(size)).complete);
}

TEST_CASE("jpeg_segments: a progressive file is whole when each coefficient has its last bit") {
  auto file = head(0xc2);
  CHECK(!jpeg_segments(file).sends_every_coefficient());
  append(file, scan(0, 0, 0x01));
  append(file, scan(1, 63, 0x00));
  CHECK(!jpeg_segments(file).sends_every_coefficient());  // the lowest bit of the mean is still missing
  append(file, scan(0, 0, 0x10));
  CHECK(jpeg_segments(file).sends_every_coefficient());
  auto baseline = head(0xc0);
  CHECK(!jpeg_segments(baseline).sends_every_coefficient());
  append(baseline, scan(0, 0, 0));  // some writers leave these numbers of a baseline scan empty
  CHECK(jpeg_segments(baseline).sends_every_coefficient());
}

TEST_CASE("jpeg_segments: a Huffman table of more than 255 symbols is found wherever a decoder may meet it") {
  // A segment of two tables, with one symbol and with 16 x 16; its length has this low byte.
  const auto tables = [](int length) {
    std::vector<std::byte> all = bytes_from({0xff, 0xc4, 0, length, 0, 1});
    all.insert(all.end(), 15, std::byte{0});
    append(all, bytes_from({5, 0x10}));
    all.insert(all.end(), 16, std::byte{16});
    return all;
  };
  const auto sound = encode_jpeg(Tensor<float>({20, 20, 3}, 0.4f), 80);
  CHECK(huffman_tables_fit(sound));
  CHECK(huffman_tables_fit({}));
  CHECK(huffman_tables_fit(bytes_from({0xff})));
  auto alone = bytes_from({0xff, 0xd8});
  append(alone, tables(37));
  CHECK(!huffman_tables_fit(alone));
  CHECK(huffman_tables_fit(std::span(alone).first(alone.size() - 1)));  // 240 symbols, then nothing
  auto longer = bytes_from({0xff, 0xd8, 1, 2, 0xff});  // other bytes and a fill byte before it
  append(longer, tables(255));                         // a segment beyond the end
  CHECK(!huffman_tables_fit(longer));
  auto within = bytes_from({0xff, 0xd8, 0xff, 0xe1, 0, 60});  // in the payload of another segment
  append(within, tables(37));
  CHECK(huffman_tables_fit(within));
  auto scanned = head(0xc0);
  append(scanned, scan(0, 63, 0));
  append(scanned, tables(37));
  CHECK(!huffman_tables_fit(scanned));
  auto behind = bytes_from({0xff, 0xd8, 0xff, 0xd9});  // nothing reads behind the end marker
  append(behind, tables(37));
  CHECK(huffman_tables_fit(behind));
  auto broken = bytes_from({0xff, 0xd8, 0xff, 0xe1, 0, 1});  // a length that no decoder accepts
  append(broken, tables(37));
  CHECK(huffman_tables_fit(broken));

  auto damaged = bytes_from({0xff, 0xd8});
  append(damaged, tables(37));
  damaged.insert(damaged.end(), sound.begin() + 2, sound.end());
  CHECK_THROWS_WITH(decode_image(damaged, "a.jpg"),
                    Contains("a.jpg") && Contains("Huffman table of more than 255 symbols"));
}

TEST_CASE("jpeg_segments: a scan needs the tables that its components name") {
  const auto sound = encode_jpeg(Tensor<float>({20, 20, 3}, 0.4f), 80);
  CHECK(jpeg_segments(sound).defines_tables());
  // Turns the n-th segment with a marker into one that every decoder skips.
  const auto without = [&](int marker, int n) {
    auto file = sound;
    for (std::size_t i = 0; i + 1 < file.size(); ++i)
      if (file[i] == std::byte{0xff} && file[i + 1] == static_cast<std::byte>(marker) && n-- == 0)
        file[i + 1] = std::byte{0xe4};
    return file;
  };
  for (const int marker : {0xc4, 0xdb}) {
    CAPTURE(marker);
    const auto file = without(marker, 0);
    REQUIRE(file != sound);
    CHECK(!jpeg_segments(file).defines_tables());
    CHECK_THROWS_WITH(decode_image(file, "a.jpg"), Contains("a.jpg") && Contains("without its Huffman"));
  }
  // Progressive: a first scan of DC needs one table, later ones of AC another, a bit of DC none.
  const auto huffman = [](int which) {
    auto all = bytes_from({0xff, 0xc4, 0, 20, which, 1});
    all.insert(all.end(), 15, std::byte{0});
    append(all, bytes_from({5}));
    return all;
  };
  auto quantised = bytes_from({0xff, 0xdb, 0, 67, 0});
  quantised.insert(quantised.end(), 64, std::byte{1});
  const auto file = [&](const std::vector<std::vector<std::byte>>& parts) {
    auto all = head(0xc2);
    append(all, quantised);
    for (const auto& part : parts) append(all, part);
    return jpeg_segments(all).defines_tables() ? 1 : 0;
  };
  CHECK(file({huffman(0), scan(0, 0, 1)}) == 1);
  CHECK(file({huffman(0x10), scan(0, 0, 1)}) == 0);
  CHECK(file({huffman(0), scan(0, 0, 1), scan(0, 0, 0x10)}) == 1);
  CHECK(file({huffman(0), scan(1, 63, 0)}) == 0);
  CHECK(file({huffman(0), scan(0, 0, 0), huffman(0x10), scan(1, 63, 0)}) == 1);
}
