#include "colmap.h"

#include <fieldmark/core/error.h>
#include <fieldmark/core/number_text.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstring>
#include <span>

#include "vec3.h"

namespace fieldmark::nerf {
namespace {

// Reads the binary format: values in memory order, with counts checked against the bytes left.
class Bytes {
 public:
  static constexpr bool kBinary = true;
  Bytes(std::string_view bytes, std::string_view name) : bytes_(bytes), name_(name) {}

  [[noreturn]] void fail(const std::string& expected, const std::string& got) const {
    throw IoError(std::string(name_) + ": byte " + std::to_string(at_) + ": expected " + expected + ", got " +
                  got);
  }
  template <class T>
  T get(const char* what) {
    if (bytes_.size() - at_ < sizeof(T)) fail(what, "the end of the file");
    T x;
    std::memcpy(&x, bytes_.data() + at_, sizeof(T));
    at_ += sizeof(T);
    return x;
  }
  // Reads a count of records that take at least `least` bytes each.
  std::uint64_t count(std::size_t least, const char* what) {
    const auto n = get<std::uint64_t>(what);
    const std::size_t most = (bytes_.size() - at_) / least;
    if (n > most)
      fail(std::string(what) + " of at most " + std::to_string(most) + " in the bytes left",
           std::to_string(n));
    return n;
  }
  std::string text(const char* what) {
    const std::size_t end = bytes_.find('\0', at_);
    if (end == std::string_view::npos) fail(what, "no byte 0 that ends it");
    std::string found(bytes_.substr(at_, end - at_));
    at_ = end + 1;
    return found;
  }
  void skip(std::uint64_t bytes) { at_ += static_cast<std::size_t>(bytes); }
  void end() const {
    if (at_ != bytes_.size())
      fail("the end of the file", std::to_string(bytes_.size() - at_) + " bytes more");
  }

 private:
  std::string_view bytes_, name_;
  std::size_t at_ = 0;
};

// Reads the text format: lines of words separated by blanks.
class Lines {
 public:
  static constexpr bool kBinary = false;
  Lines(std::string_view bytes, std::string_view name) : bytes_(bytes), name_(name) {}

  [[noreturn]] void fail(const std::string& expected, const std::string& got) const {
    throw IoError(std::string(name_) + ": line " + std::to_string(number_) + ": expected " + expected +
                  ", got " + got);
  }
  // Moves to the next line; returns false at the end.
  bool next() {
    if (at_ >= bytes_.size()) return false;
    const std::size_t end = std::min(bytes_.find('\n', at_), bytes_.size());
    line_ = bytes_.substr(at_, end - at_);
    at_ = end + 1, ++number_;
    return true;
  }
  // Skips the next line if it holds the points of an image: x, y and a key for each point. It may be empty,
  // and a model written by hand may lack it.
  void skip_points() {
    Lines ahead = *this;
    if (!ahead.next()) return;
    std::size_t words = 0;
    for (; !ahead.at_end(); ++words) {
      double x = 0;
      const std::string_view w = ahead.word("a point");
      const auto [stop, error] = std::from_chars(w.data(), w.data() + w.size(), x);
      if (error != std::errc() || stop != w.data() + w.size()) return;
    }
    if (words % 3 == 0) next();
  }
  // Moves to the next line that is neither empty nor a comment.
  bool next_record() {
    while (next())
      if (!at_end() && line_.front() != '#') return true;
    return false;
  }
  bool at_end() {
    line_.remove_prefix(std::min(line_.find_first_not_of(" \t\r"), line_.size()));
    return line_.empty();
  }
  std::string_view word(const char* what) {
    if (at_end()) fail(what, "the end of the line");
    const std::string_view w = line_.substr(0, line_.find_first_of(" \t\r"));
    line_.remove_prefix(w.size());
    return w;
  }
  // Reads the rest of the line.
  std::string text(const char* what) {
    if (at_end()) fail(what, "the end of the line");
    return std::string(line_.substr(0, line_.find_last_not_of(" \r") + 1));
  }
  template <class T>
  T get(const char* what) {
    const std::string_view w = word(what);
    T x{};
    const auto [stop, error] = std::from_chars(w.data(), w.data() + w.size(), x);
    if (error != std::errc() || stop != w.data() + w.size())
      fail(what, "'" + std::string(w.substr(0, 40)) + "'");
    return x;
  }

 private:
  std::string_view bytes_, name_, line_;
  std::size_t at_ = 0, number_ = 0;
};

// Calls use(reader) at each record. @param least, count  bytes of a record, and their count in errors
template <class F>
void each_record(std::string_view bytes, ColmapFormat format, std::string_view name, std::size_t least,
                 const char* count, F use) {
  if (format == ColmapFormat::binary) {
    Bytes in(bytes, name);
    for (auto left = in.count(least, count); left > 0; --left) use(in);
    in.end();
  } else {
    Lines in(bytes, name);
    while (in.next_record()) use(in);
  }
}

double number(auto& in, const char* what) {
  const double x = in.template get<double>(what);
  // Bounded so that sums and products stay finite.
  if (!(std::abs(x) < 1e9)) in.fail(std::string(what) + " in (-1e9, 1e9)", number_text(x));
  return x;
}

using Coefficient = double Lens::*;
// Coefficients of FULL_OPENCV, which start with those of OPENCV, RADIAL and SIMPLE_RADIAL; and of
// OPENCV_FISHEYE.
constexpr std::array<Coefficient, 8> kOpencv{&Lens::k1, &Lens::k2, &Lens::p1, &Lens::p2,
                                             &Lens::k3, &Lens::k4, &Lens::k5, &Lens::k6};
constexpr std::array<Coefficient, 4> kFisheye{&Lens::k1, &Lens::k2, &Lens::k3, &Lens::k4};

struct Model {
  std::string_view name;
  bool known;
  std::size_t lengths;                          // focal lengths
  std::span<const Coefficient> coefficients{};  // in the order of the file
  LensModel lens = LensModel::polynomial;
};

// In the order of COLMAP's model numbers.
constexpr Model kModels[] = {
    {"SIMPLE_PINHOLE", true, 1},
    {"PINHOLE", true, 2},
    {"SIMPLE_RADIAL", true, 1, std::span(kOpencv).first(1)},
    {"RADIAL", true, 1, std::span(kOpencv).first(2)},
    {"OPENCV", true, 2, std::span(kOpencv).first(4)},
    {"OPENCV_FISHEYE", true, 2, kFisheye, LensModel::fisheye},
    {"FULL_OPENCV", true, 2, kOpencv, LensModel::rational},
    {"FOV", false, 2},
    {"SIMPLE_RADIAL_FISHEYE", true, 1, std::span(kFisheye).first(1), LensModel::fisheye},
    {"RADIAL_FISHEYE", true, 1, std::span(kFisheye).first(2), LensModel::fisheye},
    {"THIN_PRISM_FISHEYE", false, 2}};

template <class Reader>
const Model& read_model(Reader& in) {
  const Model *end = std::end(kModels), *model = end;
  std::string found;
  if constexpr (Reader::kBinary) {
    const auto index = in.template get<std::int32_t>("a camera model");
    if (index >= 0 && index < std::ssize(kModels)) model = &kModels[index];
    found = model == end ? "number " + std::to_string(index) : std::string(model->name);
  } else {
    const std::string_view word = in.word("a camera model");
    const auto same = [](char a, char b) { return a == (b >= 'a' && b <= 'z' ? b - 'a' + 'A' : b); };
    model = std::find_if(std::begin(kModels), end,
                         [&](const Model& m) { return std::ranges::equal(m.name, word, same); });
    found = "'" + std::string(word.substr(0, 40)) + "'";
  }
  if (model != end && model->known) return *model;
  std::string names;
  for (const Model& m : kModels)
    if (m.known) names += (names.empty() ? "" : ", ") + std::string(m.name);
  in.fail("a camera model of " + names, found + "; undistort the images, for example with COLMAP's " +
                                            "image_undistorter, and give its result");
}

Intrinsics read_camera(auto& in) {
  const Model& model = read_model(in);
  const auto side = [&](const char* what) {
    const auto n = in.template get<std::uint64_t>(what);
    if (n < 1 || n > 65536) in.fail(std::string(what) + " of 1 to 65536 pixels", std::to_string(n));
    return static_cast<Index>(n);
  };
  const auto focal = [&] {
    const double f = number(in, "a focal length");
    if (!(f > 1e-3)) in.fail("a focal length in (0.001, 1e9) pixels", number_text(f));
    return f;
  };
  Intrinsics c;
  c.width = side("a width"), c.height = side("a height");
  c.fl_x = c.fl_y = focal();
  if (model.lengths == 2) c.fl_y = focal();
  c.cx = number(in, "a principal point"), c.cy = number(in, "a principal point");
  for (const Coefficient k : model.coefficients) c.lens.*k = number(in, "a distortion coefficient");
  c.lens.model = model.lens;
  if constexpr (!std::remove_reference_t<decltype(in)>::kBinary)
    if (!in.at_end())
      in.fail(std::to_string(model.lengths + 2 + model.coefficients.size()) + " parameters of " +
                  std::string(model.name),
              "more");
  return c;
}

// COLMAP maps x to R x + t, with the camera's axes right, down, forwards.
Pose pose_of(std::array<double, 4> q, const Vec3& t, const auto& reader) {
  const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  if (!(std::abs(length - 1) <= 1e-2))
    reader.fail("a rotation, a quaternion of length 1", "one of length " + number_text(length));
  for (double& x : q) x /= length;
  const double w = q[0], x = q[1], y = q[2], z = q[3];
  const Vec3 right{1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)};
  const Vec3 down{2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)};
  const Vec3 forward{2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)};
  Pose p{};
  for (std::size_t r = 0; r < 3; ++r) {
    p[4 * r] = right[r], p[4 * r + 1] = -down[r], p[4 * r + 2] = -forward[r];
    p[4 * r + 3] = -(t[0] * right[r] + t[1] * down[r] + t[2] * forward[r]);
  }
  return p;
}

template <class Reader>
ColmapImage read_model_image(Reader& in) {
  in.template get<std::uint32_t>("the key of an image");
  std::array<double, 4> q{};
  Vec3 t{};
  for (double& x : q) x = number(in, "a quaternion");
  for (double& x : t) x = number(in, "a translation");
  ColmapImage image;
  image.pose = pose_of(q, t, in);
  image.camera = in.template get<std::uint32_t>("the key of a camera");
  image.name = in.text("the name of an image");
  if (image.name.empty() || image.name.find('\0') != std::string::npos)
    in.fail("the name of an image", "an empty text or one with a NUL");
  // Skips the points that the image shows.
  if constexpr (Reader::kBinary)
    in.skip(24 * in.count(8 + 8 + 8, "a count of places in the image"));
  else
    in.skip_points();
  return image;
}

void check_some(const auto& found, std::string_view name, const char* what) {
  if (found.empty()) throw IoError(std::string(name) + ": expected at least one " + what + ", got none");
}
}  // namespace

std::map<std::uint32_t, Intrinsics> parse_colmap_cameras(std::string_view bytes, ColmapFormat format,
                                                         std::string_view name) {
  std::map<std::uint32_t, Intrinsics> cameras;
  each_record(bytes, format, name, 4 + 4 + 8 + 8 + 3 * 8, "a count of cameras", [&](auto& in) {
    const auto key = in.template get<std::uint32_t>("the key of a camera");
    if (!cameras.emplace(key, read_camera(in)).second)
      in.fail("each camera once", std::to_string(key) + " again");
  });
  check_some(cameras, name, "camera");
  return cameras;
}

std::vector<ColmapImage> parse_colmap_images(std::string_view bytes, ColmapFormat format,
                                             std::string_view name) {
  std::vector<ColmapImage> images;
  each_record(bytes, format, name, 4 + 7 * 8 + 4 + 1 + 8, "a count of images",
              [&](auto& in) { images.push_back(read_model_image(in)); });
  check_some(images, name, "image");
  return images;
}

}  // namespace fieldmark::nerf
