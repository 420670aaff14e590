#include <fieldmark/core/error.h>
#include <fieldmark/core/files.h>
#include <fieldmark/engine/safetensors.h>

#include <cstring>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "support/catch.h"
#include "support/temporary_folder.h"

using namespace fieldmark;

namespace {

// Builds a file from the format's description alone, without the writer.
std::string file_of(const std::string& header, const std::string& data) {
  std::string length(8, '\0');
  for (std::size_t i = 0; i < 8; ++i) length[i] = static_cast<char>(header.size() >> (8 * i) & 255);
  return length + header + data;
}
SafetensorsFile parse(const std::string& bytes) {
  return SafetensorsFile::parse(std::as_bytes(std::span(bytes)), "m.safetensors");
}
std::string one(const std::string& dtype, const std::string& shape, const std::string& offsets) {
  return "{\"x\":{\"dtype\":" + dtype + ",\"shape\":" + shape + ",\"data_offsets\":" + offsets + "}}";
}
const std::string kF32 = "\"F32\"";

SafetensorsFile sample() {
  SafetensorsFile f;
  f.metadata = {{"b", "two"}, {"a", "{\"version\": 1}"}};
  f.add("bytes", {3}, std::vector<std::uint8_t>{1, 2, 255});
  f.add("z/weight", {2, 2}, std::vector<float>{1.5f, -0.0f, std::numeric_limits<float>::infinity(), 1e-45f});
  f.add("double", {}, std::vector<double>{0.1});
  f.add("signed", {2}, std::vector<std::int32_t>{-1, 7});
  f.add("long", {1, 1, 1, 1, 1}, std::vector<std::int64_t>{-5});
  f.add("state", {1}, std::vector<std::uint64_t>{~std::uint64_t{0}});
  f.add("none", {0, 4}, std::vector<float>{});
  return f;
}

}  // namespace

TEST_CASE("safetensors: what is written is read, and equal contents give equal bytes") {
  const TemporaryFolder folder;
  const auto path = folder / "a.safetensors";
  const SafetensorsFile written = sample();
  written.write(path);
  const SafetensorsFile f = SafetensorsFile::read(path);
  CHECK(f.metadata == written.metadata);
  CHECK(f.tensors.size() == 7);
  CHECK(f.path == path.string());
  CHECK(f.f32("z/weight").shape == Shape{2, 2});
  CHECK(std::memcmp(f.f32("z/weight").data.data(), written.f32("z/weight").data.data(), 16) == 0);
  CHECK(f.f64("double").data == std::vector<double>{0.1});
  CHECK(f.f64("double").shape == Shape{});
  CHECK(f.u8("bytes") == std::vector<std::uint8_t>{1, 2, 255});
  CHECK(f.i32("signed") == std::vector<std::int32_t>{-1, 7});
  CHECK(f.i64("long") == std::vector<std::int64_t>{-5});
  CHECK(f.u64("state") == std::vector<std::uint64_t>{~std::uint64_t{0}});
  CHECK(f.f32("none").shape == Shape{0, 4});
  CHECK((f.has("none") && !f.has("None")));
  f.write(folder / "b.safetensors");
  CHECK(read_text(folder / "b.safetensors") == read_text(path));
}

TEST_CASE("safetensors: the bytes are those of the format's description, wide elements first") {
  const TemporaryFolder folder;
  SafetensorsFile f;
  f.metadata["k"] = "v";
  f.add("b", {1}, std::vector<std::uint8_t>{9});
  f.add("a", {1, 1}, std::vector<float>{1});
  f.write(folder / "f");
  std::string header =
      "{\"__metadata__\":{\"k\":\"v\"},\"a\":{\"data_offsets\":[0,4],\"dtype\":\"F32\",\"shape\":[1,1]},"
      "\"b\":{\"data_offsets\":[4,5],\"dtype\":\"U8\",\"shape\":[1]}}";
  header.resize((header.size() + 7) / 8 * 8, ' ');
  CHECK(read_text(folder / "f") == file_of(header, std::string("\0\0\x80\x3f\x09", 5)));
  SafetensorsFile().write(folder / "empty");
  CHECK(read_text(folder / "empty") == file_of("{}      ", ""));
}

TEST_CASE("safetensors: half and bfloat16 widen exactly") {
  // 1, -2, the largest number, the smallest subnormal, infinity and -0 in half precision.
  const auto half = parse(file_of(one("\"F16\"", "[6]", "[0,12]"),
                                  std::string("\x00\x3c\x00\xc0\xff\x7b\x01\x00\x00\x7c\x00\x80", 12)))
                        .f32("x");
  const std::vector<float> want{1, -2, 65504, 0x1p-24f, std::numeric_limits<float>::infinity(), -0.0f};
  CHECK(std::memcmp(half.data.data(), want.data(), 24) == 0);
  const auto brain =
      parse(file_of(one("\"BF16\"", "[2]", "[0,4]"), std::string("\x80\x3f\xc0\xbf", 4))).f32("x");
  CHECK(brain.data == std::vector<float>{1, -1.5f});
  const auto nan = parse(file_of(one("\"F16\"", "[1]", "[0,2]"), std::string("\x01\x7c", 2))).f32("x");
  CHECK(nan[0] != nan[0]);
}

TEST_CASE("safetensors: a bad length or header is an error that names file and place") {
  CHECK_THROWS_WITH(parse("abc"),
                    "[safetensors] m.safetensors: byte 0: expected 8 bytes of header length, found a "
                    "file of 3");
  CHECK_THROWS_WITH(
      parse(std::string("\x09\0\0\0\0\0\0\0{}", 10)),
      "[safetensors] m.safetensors: byte 0: expected a header length of at most 2 (the file has 10 "
      "bytes), found 9");
  CHECK_THROWS_WITH(parse(std::string(8, '\xff') + "{}"), Contains("found 18446744073709551615"));
  CHECK_THROWS_WITH(parse(file_of(" {}", "")), Contains("byte 8: expected '{'"));
  CHECK_THROWS_WITH(parse(file_of("", "")), Contains("byte 8: expected '{'"));
  CHECK_THROWS_WITH(parse(file_of("{\"a\":", "")), Contains("expected a JSON header, found: "));
  CHECK_THROWS_WITH(parse(file_of("{\"a\" 1}", "")), Contains("byte 14: expected a JSON header"));
  CHECK_THROWS_WITH(parse(file_of("{\"__metadata__\":{\"a\":1}}", "")),
                    Contains("\"a\": expected a string, found 1"));
  CHECK_THROWS_WITH(parse(file_of("{\"__metadata__\":[]}", "")),
                    Contains("expected an object of strings, found []"));
  CHECK_THROWS_WITH(parse(file_of("{\"x\":1,\"x\":2}", "")),
                    Contains("tensor \"x\": expected once in the header, found twice"));
  CHECK_THROWS_WITH(parse(file_of("{\"x\":{\"dtype\":\"F32\",\"shape\":[]}}", "")),
                    Contains("tensor \"x\": expected the key \"data_offsets\""));
  CHECK_THROWS_WITH(parse(file_of("{\"x\":3}", "")), Contains("tensor \"x\": expected an object, found 3"));
}

TEST_CASE("safetensors: a tensor that does not fit its bytes is an error") {
  auto error = [](const std::string& dtype, const std::string& shape, const std::string& offsets) {
    try {
      parse(file_of(one(dtype, shape, offsets), "01234567"));
    } catch (const IoError& e) {
      return std::string(e.what());
    }
    return std::string("accepted");
  };
  CHECK(error(kF32, "[2]", "[0,8]") == "accepted");
  CHECK_THAT(error("\"F31\"", "[2]", "[0,8]"), Contains("dtype: expected BOOL") && Contains("found \"F31\""));
  CHECK_THAT(error("5", "[2]", "[0,8]"), Contains("found 5"));
  CHECK_THAT(error(kF32, "[2]", "[0,9]"), Contains("within the 8 bytes of data, found [0,9]"));
  CHECK_THAT(error(kF32, "[2]", "[8,0]"), Contains("found [8,0]"));
  CHECK_THAT(error(kF32, "[2]", "[-8,0]"), Contains("found [-8,0]"));
  CHECK_THAT(error(kF32, "[2]", "[0,8,8]"), Contains("expected [begin, end]"));
  CHECK_THAT(error(kF32, "[3]", "[0,8]"), Contains("expected 12 bytes for F32 [3], found 8"));
  CHECK_THAT(error(kF32, "[2.0]", "[0,8]"), Contains("expected integers"));
  CHECK_THAT(error(kF32, "[-2]", "[0,8]"), Contains("expected integers"));
  CHECK_THAT(error(kF32, "2", "[0,8]"), Contains("expected an array of at most 5 extents, found 2"));
  CHECK_THAT(error(kF32, "[1,1,1,1,1,2]", "[0,8]"), Contains("at most 5 extents"));
  // 2^62 elements of 4 bytes are 0 modulo 2^64, as are 2^32 * 2^32.
  CHECK_THAT(error(kF32, "[4611686018427387904]", "[0,0]"), Contains("expected at most 2^62 bytes"));
  CHECK_THAT(error(kF32, "[4294967296,4294967296,0]", "[0,0]"), Contains("expected at most 2^62 bytes"));
  CHECK_THAT(error(kF32, "[1]", "[0,4]"), Contains("found 4 more bytes that belong to no tensor"));
  CHECK_THAT(error(kF32, "[1]", "[4,8]"), Contains("expected to begin at 0") && Contains("found 4"));
  const std::string overlap =
      "{\"x\":{\"dtype\":\"U8\",\"shape\":[5],\"data_offsets\":[0,5]},"
      "\"y\":{\"dtype\":\"U8\",\"shape\":[4],\"data_offsets\":[4,8]}}";
  CHECK_THROWS_WITH(parse(file_of(overlap, "01234567")),
                    Contains("tensor \"y\"") && Contains("to begin at 5") && Contains("found 4"));
}

TEST_CASE("safetensors: wrong names, dtypes and sizes are errors") {
  SafetensorsFile f = sample();
  f.path = "m";
  CHECK_THROWS_WITH(f.f32("w"),
                    "[safetensors] m: expected a tensor \"w\", found 7: bytes, z/weight, double, signed, "
                    "long, state, none");
  CHECK_THROWS_WITH(f.f32("double"), "[safetensors] m: tensor \"double\": expected dtype F32, found F64");
  CHECK_THROWS_AS(f.u8("signed"), IoError);
  CHECK_THROWS_WITH(f.add("none", {0}, std::vector<float>{}),
                    Contains("name must be new") && Contains("got none"));
  CHECK_THROWS_AS(f.add("__metadata__", {0}, std::vector<float>{}), ValueError);
  CHECK_THROWS_WITH(f.add("w", {2, 3}, std::vector<float>(5)),
                    "[SafetensorsFile::add] data of w must have the 6 elements of shape [2, 3], got 5");
  const TemporaryFolder folder;
  f.metadata["bad"] = "\xff";
  CHECK_THROWS_AS(f.write(folder / "f"), ValueError);
  CHECK(folder.entries() == 0);
  CHECK_THROWS_WITH(SafetensorsFile::read(folder / "f"), Contains("No such file"));
}

TEST_CASE("safetensors: 30,000 damaged files are read or refused, nothing else") {
  const TemporaryFolder folder;
  sample().write(folder / "f");
  const std::string good = read_text(folder / "f");
  const std::string spice = "{}[]\",:-0123456789e\\\xff";
  std::mt19937 rng(1);
  auto below = [&](std::size_t n) { return static_cast<std::size_t>(rng()) % n; };
  int read = 0, refused = 0, other = 0;
  for (int round = 0; round < 30000; ++round) {
    std::string bytes = good;
    for (std::size_t k = 0; k < 1 + below(4) && !bytes.empty(); ++k) {
      const std::size_t at = below(bytes.size());
      switch (below(5)) {
        case 0:
          bytes[at] = static_cast<char>(rng());
          break;
        case 1:
          bytes[at] = spice[below(spice.size())];
          break;
        case 2:
          bytes.erase(at, below(9));
          break;
        case 3:
          bytes.insert(at, bytes.substr(below(bytes.size()), below(40)));
          break;
        default:
          bytes.resize(at + 1);
      }
    }
    try {
      parse(bytes);
      ++read;
    } catch (const IoError&) {
      ++refused;
    } catch (...) {
      ++other;
    }
  }
  CHECK(other == 0);
  CHECK(read > 100);
  CHECK(refused > 10000);
}
