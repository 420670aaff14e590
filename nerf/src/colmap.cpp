#include "colmap.h"

#include <algorithm>
#include <array>

#include "colmap_reader.h"
#include "vec3.h"

namespace fieldmark::nerf {
namespace {

struct Model {
  std::string_view name;
  std::size_t parameters;  // 0: not known here
};
// In the order of COLMAP's numbers.
constexpr Model kModels[] = {{"SIMPLE_PINHOLE", 3},
                             {"PINHOLE", 4},
                             {"SIMPLE_RADIAL", 4},
                             {"RADIAL", 5},
                             {"OPENCV", 8},
                             {"OPENCV_FISHEYE", 0},
                             {"FULL_OPENCV", 0},
                             {"FOV", 0},
                             {"SIMPLE_RADIAL_FISHEYE", 0},
                             {"RADIAL_FISHEYE", 0},
                             {"THIN_PRISM_FISHEYE", 0}};
constexpr const char* kKnown = "a camera model SIMPLE_PINHOLE, PINHOLE, SIMPLE_RADIAL, RADIAL or OPENCV";

template <class Reader>
Intrinsics read_camera(Reader& reader, const Model& model) {
  const auto side = [&](const char* what) {
    const auto n = reader.template get<std::uint64_t>(what);
    if (n < 1 || n > 65536) reader.fail(std::string(what) + " of 1 to 65536 pixels", std::to_string(n));
    return static_cast<Index>(n);
  };
  const auto focal = [&] {
    const double f = reader.number("a focal length");
    if (!(f > 1e-3)) reader.fail("a focal length in (0.001, 1e9) pixels", std::to_string(f));
    return f;
  };
  Intrinsics c;
  c.width = side("a width"), c.height = side("a height");
  c.fl_x = c.fl_y = focal();
  if (model.name == "PINHOLE" || model.name == "OPENCV") c.fl_y = focal();
  c.cx = reader.number("a principal point"), c.cy = reader.number("a principal point");
  const std::size_t left = model.parameters - (model.name == "PINHOLE" || model.name == "OPENCV" ? 4 : 3);
  double* const to[] = {&c.lens.k1, &c.lens.k2, &c.lens.p1, &c.lens.p2};
  for (std::size_t i = 0; i < left; ++i) *to[i] = reader.number("a distortion coefficient");
  return c;
}

void add(std::map<std::uint32_t, Intrinsics>& cameras, std::uint32_t key, const Intrinsics& camera,
         const auto& reader) {
  if (!cameras.emplace(key, camera).second) reader.fail("each camera once", std::to_string(key) + " again");
}

// COLMAP has x_camera = R x + t with axes right, down, forwards.
Pose pose_of(std::array<double, 4> q, const Vec3& t, const auto& reader) {
  const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  if (!(std::abs(length - 1) <= 1e-2))
    reader.fail("a rotation, a quaternion of length 1", "one of length " + std::to_string(length));
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

// The key, rotation, position and camera, which both formats have in this order.
template <class Reader>
ColmapImage read_image_head(Reader& reader) {
  reader.template get<std::uint32_t>("the key of an image");
  std::array<double, 4> q{};
  Vec3 t{};
  for (double& x : q) x = reader.number("a quaternion");
  for (double& x : t) x = reader.number("a translation");
  ColmapImage image;
  image.pose = pose_of(q, t, reader);
  image.camera = reader.template get<std::uint32_t>("the key of a camera");
  return image;
}

void check_name(const ColmapImage& image, const auto& reader) {
  if (image.name.empty() || image.name.find('\0') != std::string::npos)
    reader.fail("the name of an image", "an empty text or one with a NUL");
}

// -1 is a place in the image without a point.
void add_point(ColmapImage& image, std::int64_t key, const auto& reader) {
  if (key < -1) reader.fail("the key of a point, or -1", std::to_string(key));
  if (key >= 0) image.points.push_back(static_cast<std::uint64_t>(key));
}

void add(std::map<std::uint64_t, Vec3>& points, std::uint64_t key, auto& reader) {
  Vec3 p{};
  for (double& x : p) x = reader.number("a coordinate");
  if (!points.emplace(key, p).second) reader.fail("each point once", std::to_string(key) + " again");
}

void check_some(const auto& found, std::string_view name, const char* what) {
  if (found.empty()) throw IoError(std::string(name) + ": expected at least one " + what + ", got none");
}
}  // namespace

std::map<std::uint32_t, Intrinsics> parse_colmap_cameras(std::string_view bytes, ColmapFormat format,
                                                         std::string_view name) {
  std::map<std::uint32_t, Intrinsics> cameras;
  if (format == ColmapFormat::binary) {
    ColmapBytes in(bytes, name);
    for (auto left = in.count(4 + 4 + 8 + 8 + 3 * 8, "a count of cameras"); left > 0; --left) {
      const auto key = in.get<std::uint32_t>("the key of a camera");
      const auto model = in.get<std::int32_t>("a camera model");
      const bool named = model >= 0 && static_cast<std::size_t>(model) < std::size(kModels);
      if (!named) in.fail(kKnown, "number " + std::to_string(model));
      const Model& m = kModels[model];
      if (m.parameters == 0) in.fail(kKnown, std::string(m.name));
      add(cameras, key, read_camera(in, m), in);
    }
    in.end();
  } else {
    ColmapLines in(bytes, name);
    while (in.next_record()) {
      const auto key = in.get<std::uint32_t>("the key of a camera");
      const std::string_view word = in.word("a camera model");
      const auto* m = std::find_if(std::begin(kModels), std::end(kModels),
                                   [&](const Model& k) { return k.name == word && k.parameters > 0; });
      if (m == std::end(kModels)) in.fail(kKnown, "'" + std::string(word.substr(0, 40)) + "'");
      add(cameras, key, read_camera(in, *m), in);
      if (!in.at_end())
        in.fail(std::to_string(m->parameters) + " parameters of " + std::string(m->name), "more");
    }
  }
  check_some(cameras, name, "camera");
  return cameras;
}

std::vector<ColmapImage> parse_colmap_images(std::string_view bytes, ColmapFormat format,
                                             std::string_view name) {
  std::vector<ColmapImage> images;
  if (format == ColmapFormat::binary) {
    ColmapBytes in(bytes, name);
    for (auto left = in.count(4 + 7 * 8 + 4 + 1 + 8, "a count of images"); left > 0; --left) {
      ColmapImage image = read_image_head(in);
      image.name = in.text("the name of an image");
      check_name(image, in);
      for (auto n = in.count(8 + 8 + 8, "a count of places in the image"); n > 0; --n) {
        in.skip(16);  // where in the image
        add_point(image, in.get<std::int64_t>("the key of a point"), in);
      }
      images.push_back(std::move(image));
    }
    in.end();
  } else {
    ColmapLines in(bytes, name);
    while (in.next_record()) {
      ColmapImage image = read_image_head(in);
      image.name = in.rest("the name of an image");
      check_name(image, in);
      // The line of places in the image may be empty, and the last may lack.
      if (in.next())
        while (!in.at_end()) {
          in.number("a place in the image"), in.number("a place in the image");
          add_point(image, in.get<std::int64_t>("the key of a point"), in);
        }
      images.push_back(std::move(image));
    }
  }
  check_some(images, name, "image");
  return images;
}

std::map<std::uint64_t, Vec3> parse_colmap_points(std::string_view bytes, ColmapFormat format,
                                                  std::string_view name) {
  std::map<std::uint64_t, Vec3> points;
  if (format == ColmapFormat::binary) {
    ColmapBytes in(bytes, name);
    for (auto left = in.count(8 + 3 * 8 + 3 + 8 + 8, "a count of points"); left > 0; --left) {
      add(points, in.get<std::uint64_t>("the key of a point"), in);
      in.get<std::array<std::uint8_t, 3>>("a colour"), in.get<double>("an error");
      in.skip(8 * in.count(8, "a count of images that show it"));
    }
    in.end();
  } else {
    ColmapLines in(bytes, name);
    while (in.next_record()) add(points, in.get<std::uint64_t>("the key of a point"), in);
  }
  return points;
}

std::optional<DepthRange> colmap_depth(const ColmapImage& image,
                                       const std::map<std::uint64_t, Vec3>& points) {
  const Pose& p = image.pose;
  std::vector<double> depths;
  for (const auto key : image.points) {
    const auto at = points.find(key);
    if (at == points.end())
      throw ValueError("[colmap_depth] image: must name points of the model, got " + std::to_string(key) +
                       " in " + image.name);
    const double depth = -dot({p[2], p[6], p[10]}, at->second - Vec3{p[3], p[7], p[11]});
    if (depth > 0) depths.push_back(depth);
  }
  if (depths.empty()) return std::nullopt;
  std::sort(depths.begin(), depths.end());
  const auto quantile = [&](double q) {
    return depths[static_cast<std::size_t>(std::lround(q * static_cast<double>(depths.size() - 1)))];
  };
  const DepthRange range{.near = quantile(0.001), .far = quantile(0.999)};
  return range.near < range.far ? std::optional<DepthRange>(range) : std::nullopt;
}

}  // namespace fieldmark::nerf
