#include "transforms.h"
#include <fieldmark/core/error.h>

#include <cmath>
#include <random>
#include <string>

#include "support/catch.h"

using namespace fieldmark;
using namespace fieldmark::nerf;

namespace {
const std::string kGood =
    "{\"camera_angle_x\": 0.7,\n \"frames\": [\n"
    "  {\"file_path\": \"./train/r_0\", \"rotation\": 0.1, \"transform_matrix\":\n"
    "   [[1, 0, 0, 0.5], [0, 0, -1, 2], [0, 1, 0, 3], [0, 0, 0, 1]]},\n"
    "  {\"file_path\": \"b.png\", \"transform_matrix\": [[0.6, -0.8, 0, 1], [0.8, 0.6, 0, 2], [0, 0, 1, 4], "
    "[0, 0, 0, 1]]}]}";

// Returns kGood with one piece replaced.
std::string with(const std::string& piece, const std::string& by) {
  std::string text = kGood;
  const auto at = text.find(piece);
  REQUIRE(at != std::string::npos);
  return text.replace(at, piece.size(), by);
}
void expect_error(const std::string& text, const std::string& message) {
  CHECK_THROWS_WITH(parse_transforms(text, "lego/t.json"), Contains("lego/t.json: " + message));
  CHECK_THROWS_AS(parse_transforms(text, "lego/t.json"), IoError);
}
}  // namespace

TEST_CASE("transforms: reads angle, names and poses") {
  const Transforms t = parse_transforms(kGood, "t.json");
  CHECK(t.camera_angle_x == 0.7);
  REQUIRE(t.frames.size() == 2);
  CHECK(t.frames[0].file_path == "./train/r_0");
  CHECK(t.frames[0].pose == Pose{1, 0, 0, 0.5, 0, 0, -1, 2, 0, 1, 0, 3});
  CHECK(t.frames[1].file_path == "b.png");
}

TEST_CASE("transforms: what is written reads back to the same numbers") {
  Transforms t = parse_transforms(kGood, "t.json");
  t.camera_angle_x = 0.6911112070083618;
  t.frames[1].pose[3] = 1.0 / 3;
  const Transforms back = parse_transforms(format_transforms(t), "t.json");
  CHECK(back.camera_angle_x == t.camera_angle_x);
  REQUIRE(back.frames.size() == 2);
  for (std::size_t i = 0; i < 2; ++i) {
    CHECK(back.frames[i].file_path == t.frames[i].file_path);
    CHECK(back.frames[i].pose == t.frames[i].pose);
  }
}

TEST_CASE("transforms: errors of content name place, expectation and find") {
  expect_error("[]", "expected an object, got array");
  expect_error(with("\"camera_angle_x\"", "\"angle\""),
               "expected the key \"camera_angle_x\" or \"fl_x\", got neither, nor in frames[0]");
  expect_error(with("0.7", "\"wide\""), "camera_angle_x: expected a number, got string");
  for (const char* bad : {"0", "-1", "3.2"})
    expect_error(with("0.7", bad), "camera_angle_x: expected a number in (0, pi) radians, got ");
  expect_error("{\"camera_angle_x\": 1, \"frames\": []}", "frames: expected at least one view, got none");
  expect_error("{\"camera_angle_x\": 1, \"frames\": {}}", "frames: expected an array, got object");
  expect_error("{\"camera_angle_x\": 1, \"frames\": [3]}", "frames[0]: expected an object, got number");
  expect_error(with("\"b.png\"", "7"), "frames[1].file_path: expected text, got number");
  expect_error(with("\"b.png\"", "\"\""),
               "frames[1].file_path: expected the name of an image, got an empty text");
  expect_error(with("\"file_path\": \"b.png\", ", ""), "frames[1]: expected the key \"file_path\", got none");
}

TEST_CASE("transforms: errors of matrices name row and column") {
  const std::string at = "frames[1].transform_matrix";
  const std::string last = ", [0, 0, 1, 4], [0, 0, 0, 1]";
  expect_error(with("[0.6, -0.8, 0, 1], [0.8, 0.6, 0, 2]" + last, "[0, 0, 0, 1]"),
               at + ": expected 4x4 or 3x4 numbers, got 1 rows");
  expect_error(with(last, ", [0, 0, 0, 1]"),
               at + ": expected a rotation");  // 3x4, with the last row in place of the third
  expect_error(with(last, ", [0, 0, 1], [0, 0, 0, 1]"), at + "[2]: expected 4 numbers, got 3");
  expect_error(with(last, ", 5, [0, 0, 0, 1]"), at + "[2]: expected an array, got number");
  expect_error(with(last, ", [0, null, 1, 4], [0, 0, 0, 1]"), at + "[2][1]: expected a number, got null");
  expect_error(
      with(last, ", [0, 0, 1.01, 4], [0, 0, 0, 1]"),
      at + ": expected a rotation in the upper left 3x3, got columns that are off orthonormal by 0.0201");
  expect_error(
      with(last, ", [0, 0, -1, 4], [0, 0, 0, 1]"),
      at + ": expected a rotation in the upper left 3x3, got a mirror, determinant -1, as in 1 of 2 frames");
  expect_error(
      with(last, ", [0, 0, 2, 4], [0, 0, 0, 1]"),
      at + ": expected a rotation in the upper left 3x3, got columns that are off orthonormal by 3: they "
           "are of lengths 1, 1 and 2, with a determinant of 2");
  expect_error(with(last, ", [0, 0, 1, 4], [0, 0.5, 0, 1]"),
               at + "[3]: expected the row 0 0 0 1, got 0.5 in column 1");
  expect_error(with(last, ", [0, 0, 1, 4], [0, 0, 0, 0]"),
               at + "[3]: expected the row 0 0 0 1, got 0 in column 3");
}

TEST_CASE("transforms: scaled, homogeneous, mirrored and 3x4 matrices are the poses that they mean") {
  const Transforms plain = parse_transforms(kGood, "t.json");
  const std::string second = "[[0.6, -0.8, 0, 1], [0.8, 0.6, 0, 2], [0, 0, 1, 4], [0, 0, 0, 1]]";
  const auto expect = [&](const std::string& by, const std::string& note) {
    const Transforms t = parse_transforms(with(second, by), "t.json");
    for (std::size_t k = 0; k < 12; ++k)
      CHECK(std::abs(t.frames[1].pose[k] - plain.frames[1].pose[k]) < 1e-15);
    CHECK(t.frames[0].pose == plain.frames[0].pose);
    CHECK(t.notes == (note.empty() ? std::vector<std::string>{} : std::vector<std::string>{note}));
  };
  expect("[[0.6, -0.8, 0, 1], [0.8, 0.6, 0, 2], [0, 0, 1, 4]]", "");
  expect("[[1.2, -1.6, 0, 1], [1.6, 1.2, 0, 2], [0, 0, 2, 4], [0, 0, 0, 1]]",
         "1 of 2 poses have a scale, the first 2, which is taken out of their rotations");
  expect("[[-1.2, 1.6, 0, -2], [-1.6, -1.2, 0, -4], [0, 0, -2, -8], [0, 0, 0, -2]]",
         "1 of 2 poses are divided by the last number of their fourth row");
  // In a mirrored world, the rays of both frames are mirrored and nothing else changes.
  std::string both = with(second, "[[-0.6, 0.8, 0, -1], [0.8, 0.6, 0, 2], [0, 0, 1, 4], [0, 0, 0, 1]]");
  both.replace(both.find("[[1, 0, 0, 0.5]"), 15, "[[-1, 0, 0, -0.5]");
  const Transforms mirrored = parse_transforms(both, "t.json");
  for (std::size_t f = 0; f < 2; ++f) CHECK(mirrored.frames[f].pose == plain.frames[f].pose);
  CHECK(mirrored.notes ==
        std::vector<std::string>{"all poses are those of a mirrored world, which is mirrored back along x"});
}

TEST_CASE("transforms: what is not used is told of, once") {
  const auto notes = [](const std::string& keys, const std::string& of_frame = "") {
    std::string text = with("\"camera_angle_x\": 0.7,", "\"camera_angle_x\": 0.7, " + keys);
    text.replace(text.find("\"file_path\": \"b.png\","), 21, "\"file_path\": \"b.png\"," + of_frame);
    return parse_transforms(text, "t.json").notes;
  };
  using Notes = std::vector<std::string>;
  CHECK(notes("\"aabb_scale\": 4,", "\"sharpness\": 3,").empty());
  CHECK(notes("\"wobble\": 4, \"k7\": 1,", "\"wobble\": 4, \"exposure\": 1,") ==
        Notes{"keys that are not known and not used: exposure, k7, wobble"});
  CHECK(notes("", "\"time\": 0.5,") ==
        Notes{"frames have a time, which is not used: a scene that moves is taken as still"});
  CHECK(notes("\"rolling_shutter\": [0, 0, 0, 0],").empty());
  CHECK(notes("\"rolling_shutter\": [0, 0.1, 0, 0],") ==
        Notes{"rolling_shutter is not known and not used: each image is taken as one moment"});
}

TEST_CASE("transforms: intrinsics of the file, each replaced where a frame has its own") {
  const Transforms t = parse_transforms(
      with("\"camera_angle_x\": 0.7,",
           "\"fl_x\": 20, \"fl_y\": 21, \"cx\": 5.5, \"cy\": 4, \"w\": 12.0, \"h\": 8, \"k1\": 0.1, \"k2\": "
           "0.2, "
           "\"p1\": 0.3, \"p2\": 0.4, \"k3\": 0, \"k4\": 0.0, \"is_fisheye\": false, \"aabb_scale\": 16, "
           "\"camera_model\": \"OPENCV\","),
      "t.json");
  CHECK(t.camera_angle_x == 0);
  const Intrinsics& i = t.frames[1].intrinsics;
  CHECK((i.fl_x == 20 && i.fl_y == 21 && i.cx == 5.5 && i.cy == 4.0 && i.width == 12 && i.height == 8));
  CHECK(i.lens == Lens{.k1 = 0.1, .k2 = 0.2, .p1 = 0.3, .p2 = 0.4});
  const Transforms own = parse_transforms(
      with("\"b.png\",", "\"b.png\", \"camera_angle_y\": 0.5, \"fl_x\": 9, \"k1\": -0.1, \"cx\": 1,"),
      "t.json");
  CHECK(own.frames[0].intrinsics.angle_x == 0.7);
  CHECK((own.frames[0].intrinsics.fl_x == 0 && !own.frames[0].intrinsics.cx));
  const Intrinsics& frame = own.frames[1].intrinsics;
  CHECK((frame.fl_x == 9 && frame.angle_y == 0.5 && frame.lens.k1 == -0.1 && frame.cx == 1.0));
  // A frame's angle takes precedence over the file's focal length.
  std::string text = with("\"camera_angle_x\"", "\"fl_x\"");
  text.insert(text.find("\"file_path\": \"b.png\""), "\"camera_angle_x\": 0.6, ");
  const Transforms angle = parse_transforms(text, "t.json");
  CHECK((angle.frames[1].intrinsics.angle_x == 0.6 && angle.frames[1].intrinsics.fl_x == 0));
}

TEST_CASE("transforms: models of lenses, by name in any case, by is_fisheye and by k5 and k6") {
  const auto lens = [](const std::string& keys, const std::string& of_frame = "") {
    std::string text = with("\"camera_angle_x\": 0.7,", "\"camera_angle_x\": 0.7, " + keys);
    text.replace(text.find("\"file_path\": \"b.png\","), 21, "\"file_path\": \"b.png\"," + of_frame);
    return parse_transforms(text, "t.json").frames[1].intrinsics.lens;
  };
  CHECK(lens("\"camera_model\": \"opencv\", \"k3\": 0.1, \"k4\": 0.2,") == Lens{.k3 = 0.1, .k4 = 0.2});
  CHECK(lens("\"k1\": 0.5, \"k6\": 0.1,") == Lens{.k1 = 0.5, .k6 = 0.1, .model = LensModel::rational});
  CHECK(lens("\"camera_model\": \"FULL_OPENCV\", \"k4\": 0.1,") ==
        Lens{.k4 = 0.1, .model = LensModel::rational});
  CHECK(lens("\"camera_model\": \"OPENCV_FISHEYE\",", "\"k1\": 0.1,") ==
        Lens{.k1 = 0.1, .model = LensModel::fisheye});
  CHECK(lens("\"is_fisheye\": true, \"k4\": 0.1,") == Lens{.k4 = 0.1, .model = LensModel::fisheye});
  for (const char* no : {"0", "false", "null", "0.0"})
    CHECK(lens("\"is_fisheye\": " + std::string(no) + ",").is_pinhole());
}

TEST_CASE("transforms: lenses and sizes that are not known are refused by name") {
  const auto expect = [](const std::string& keys, const std::string& message) {
    expect_error(with("\"camera_angle_x\": 0.7,", "\"camera_angle_x\": 0.7, " + keys + ","), message);
  };
  expect("\"is_fisheye\": true, \"p1\": 0.1",
         "frames[0]: expected a fisheye of k1 to k4, got p1, p2, k5 or k6");
  expect("\"camera_model\": \"EQUIRECTANGULAR\"",
         "camera_model: expected one of OPENCV, PINHOLE, SIMPLE_PINHOLE, SIMPLE_RADIAL, RADIAL, PERSPECTIVE, "
         "FULL_OPENCV, OPENCV_FISHEYE, SIMPLE_RADIAL_FISHEYE, RADIAL_FISHEYE, got \"EQUIRECTANGULAR\"; "
         "undistort");
  expect("\"ftheta_p0\": 0.1", "ftheta_p0: expected a lens of k1 to k6, p1 and p2");
  expect("\"fl_x\": 0", "fl_x: expected a number in (0.001, 1e9) pixels, got 0");
  expect("\"cx\": \"left\"", "cx: expected a number, got string");
  expect("\"w\": 0, \"h\": 8", "w: expected a number in 1 to 65536, got 0");
  expect("\"w\": 8", "expected the keys \"w\" and \"h\" or neither of them, got one");
  expect("\"k1\": 1e300", "k1: expected a number in (-1e9, 1e9), got ");
}

TEST_CASE("transforms: a rotation that is a little off is replaced by the nearest one") {
  // Scaled by 1.004 and sheared: off by 8e-3, and the nearest rotation is the original one.
  const Transforms t =
      parse_transforms(with("[0.6, -0.8, 0, 1], [0.8, 0.6, 0, 2], [0, 0, 1, 4]",
                            "[0.6024, -0.8032, 0, 1], [0.8032, 0.6024, 0, 2], [0, 0, 1.001, 4]"),
                       "t.json");
  const Pose want{0.6, -0.8, 0, 1, 0.8, 0.6, 0, 2, 0, 0, 1, 4};
  for (std::size_t k = 0; k < 12; ++k) CHECK(std::abs(t.frames[1].pose[k] - want[k]) < 1e-12);
  // Single-precision errors are left as they are.
  const Transforms kept = parse_transforms(with("0.6, -0.8", "0.600001, -0.8"), "t.json");
  CHECK(kept.frames[1].pose[0] == 0.600001);
}

TEST_CASE("transforms: errors of syntax name line and byte") {
  expect_error("", "line 1, byte 0: expected JSON, got the end of the text");
  expect_error("{\n\"camera_angle_x\": x}", "line 2, byte 20: expected JSON, got 'x'");
  expect_error(kGood.substr(0, kGood.size() - 1), "line 5, byte " + std::to_string(kGood.size() - 1));
  expect_error("{\"a\": \"\x01\"}", "line 1, byte 7: expected JSON, got byte value 1");
  const std::string large = with("0.5", "\n1e999");
  expect_error(large, "line 5, byte " + std::to_string(large.find("1e999")) +
                          ": expected JSON, got the number 1e999, too large");
}

TEST_CASE("transforms: 20000 mutations of a file either read or throw IoError") {
  std::mt19937_64 rng(1);
  const std::string pieces[] = {"[",    "]", "{",   "}",       ",",    "\"",    "1e999",
                                "null", "-", "NaN", "\\u0000", "\xFF", "1e308", ":"};
  int read = 0, thrown = 0;
  for (int round = 0; round < 20000; ++round) {
    std::string text = kGood;
    for (auto edits = 1 + rng() % 4; edits > 0 && !text.empty(); --edits) {
      const auto at = rng() % text.size();
      switch (rng() % 5) {
        case 0:
          text[at] = static_cast<char>(rng());
          break;
        case 1:
          text.erase(at, 1 + rng() % 8);
          break;
        case 2:
          text.insert(at, pieces[rng() % std::size(pieces)]);
          break;
        case 3:
          text.insert(at, text.substr(rng() % text.size(), rng() % 40));
          break;
        default:
          text.resize(at);
      }
    }
    try {
      const Transforms t = parse_transforms(text, "t");
      ++read;
      if (t.frames.empty() || !(t.camera_angle_x > 0)) FAIL("accepted " << text);
    } catch (const IoError&) {
      ++thrown;
    }
  }
  CHECK(read > 100);
  CHECK(thrown > 10000);
}
