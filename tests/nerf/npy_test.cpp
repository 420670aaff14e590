#include "npy.h"
#include <fieldmark/core/error.h>

#include <string>

#include "nerf/format_samples.h"
#include "support/catch.h"

using namespace fieldmark;
using namespace fieldmark::nerf;

namespace {
void expect_npy_error(const std::string& bytes, const std::string& message) {
  CHECK_THROWS_WITH(parse_npy(bytes, "a.npy"), Contains("a.npy: byte ") && Contains(message));
  CHECK_THROWS_AS(parse_npy(bytes, "a.npy"), IoError);
}
const std::string kHeader = "{'descr': '<f8', 'fortran_order': False, 'shape': (2, 3), }";
const std::string kSix = packed<double>({1, 2, 3, 4, 5, 6});
std::string with_header(const std::string& header) { return npy_file(header, kSix); }
}  // namespace

TEST_CASE("npy: formats 1 to 3, floats of 4 and 8 bytes, keys in any order") {
  for (const char version : {1, 2, 3}) {
    const NpyArray a = parse_npy(npy_file(kHeader, kSix, version), "a.npy");
    CHECK(a.shape == std::vector<Index>{2, 3});
    CHECK(a.numbers == std::vector<double>{1, 2, 3, 4, 5, 6});
  }
  const NpyArray f4 = parse_npy(
      npy_file("{\"shape\":(3,),\"descr\":\"<f4\",\"fortran_order\":False}", packed<float>({0.5f, -1, 3})),
      "a.npy");
  CHECK(f4.shape == std::vector<Index>{3});
  CHECK(f4.numbers == std::vector<double>{0.5, -1, 3});
  const NpyArray scalar = parse_npy(
      npy_file("{'descr': '<f8', 'fortran_order': False, 'shape': (), }", packed<double>({7})), "a");
  CHECK(scalar.shape.empty());
  CHECK(scalar.numbers == std::vector<double>{7});
  CHECK(parse_npy(npy_file("{'descr': '<f8', 'fortran_order': False, 'shape': (0, 5), }", ""), "a")
            .numbers.empty());
}

TEST_CASE("npy: Fortran order is turned into C order") {
  const NpyArray a =
      parse_npy(with_header("{'descr': '<f8', 'fortran_order': True, 'shape': (2, 3), }"), "a");
  CHECK(a.shape == std::vector<Index>{2, 3});
  CHECK(a.numbers == std::vector<double>{1, 3, 5, 2, 4, 6});
  std::vector<double> many(24);
  for (std::size_t i = 0; i < 24; ++i) many[i] = static_cast<double>(i);
  const NpyArray b =
      parse_npy(npy_file("{'descr': '<f8', 'fortran_order': True, 'shape': (2, 3, 4), }", packed(many)), "b");
  for (std::size_t x = 0; x < 2; ++x)
    for (std::size_t y = 0; y < 3; ++y)
      for (std::size_t z = 0; z < 4; ++z)
        CHECK(b.numbers[(x * 3 + y) * 4 + z] == static_cast<double>(x + 2 * (y + 3 * z)));
}

TEST_CASE("npy: what is not read is named") {
  expect_npy_error("hello world, hello", "expected an .npy file");
  expect_npy_error("\x93NUMPY\x01", "expected 12 bytes at least");
  expect_npy_error(npy_file(kHeader, kSix, 4), "expected format 1, 2 or 3, got 4");
  expect_npy_error(with_header("{'descr': '>f8', 'fortran_order': False, 'shape': (2, 3), }"),
                   "expected descr '<f4' or '<f8' (little-endian floats), got \">f8\"");
  expect_npy_error(with_header("{'descr': '<f8', 'fortran_order': 1, 'shape': (2, 3), }"),
                   "expected fortran_order True or False, got 1");
  expect_npy_error(with_header("{'descr': '<f8', 'fortran_order': False}"), "none called shape");
  expect_npy_error(with_header("{'descr': [('a', '<f8')], 'fortran_order': False, 'shape': (6,)}"),
                   "expected descr '<f4' or '<f8' (little-endian floats), got [[\"a\",\"<f8\"]]");
  for (const char* shape : {"(2, -3)", "(2, 3.5)", "(2, 'x')", "(99999999999999999999,)"})
    expect_npy_error(
        with_header("{'descr': '<f8', 'fortran_order': False, 'shape': " + std::string(shape) + ", }"),
        "expected whole numbers from 0 for shape, got [");
  expect_npy_error(with_header("{'descr': '<f8', 'fortran_order': False, 'shape': 6}"),
                   "expected a tuple for shape, got 6");
  for (const std::string& header :
       {std::string("{'descr': '<f8'"), kHeader + "x", std::string("[1]"), std::string()})
    expect_npy_error(with_header(header), "expected a Python dictionary, got something else");
}

TEST_CASE("npy: sizes that do not fit are refused before anything is allocated") {
  expect_npy_error(npy_file(kHeader, kSix.substr(0, 47)),
                   "expected 48 bytes of elements for the shape in the header, got 47");
  expect_npy_error(npy_file(kHeader, kSix + "x"), "got 49 bytes");
  for (const char* shape :
       {"(999999999999999999, 999999999999999999)", "(2, 999999999999999999)", "(4294967296, 4294967296, 2)"})
    expect_npy_error(
        with_header("{'descr': '<f8', 'fortran_order': False, 'shape': " + std::string(shape) + ", }"),
        "expected more elements than the file has bytes for the shape in the header, got 48 bytes");
  std::string long_header = with_header(kHeader);
  long_header[9] = '\x7F';
  expect_npy_error(long_header, "expected a header of at most 108 bytes, got 32572");
}
