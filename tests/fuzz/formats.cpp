#include "fuzz/formats.h"

#include <fieldmark/core/error.h>
#include <fieldmark/core/files.h>
#include <fieldmark/engine/safetensors.h>
#include <fieldmark/imaging/exif.h>
#include <fieldmark/imaging/image.h>
#include <fieldmark/imaging/image_format.h>
#include <fieldmark/imaging/video/video_reader.h>
#include <fieldmark/imaging/video/video_writer.h>
#include <fieldmark/nerf/analytic_scene.h>
#include <fieldmark/nerf/trainer.h>
#include <fieldmark/watermark/embedding/baker.h>
#include <fieldmark/watermark/embedding/embedder.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cmath>
#include <map>
#include <memory>

#include "canonical_json.h"
#include "cli/camera_path.h"
#include "cli/cli.h"
#include "cli/kept_readings.h"
#include "colmap.h"
#include "imaging/jpeg_bytes.h"
#include "imaging/media_samples.h"
#include "lens.h"
#include "llff.h"
#include "nerf/format_samples.h"
#include "npy.h"
#include "support/temporary_folder.h"
#include "transforms.h"
#include "watermark/small_evidence.h"
#include "watermark/small_owner.h"

using namespace fieldmark;
using namespace fieldmark::nerf;

namespace {

const std::string kTransforms =
    R"({"camera_angle_x": 0.75, "fl_x": 343.88, "fl_y": 343.6, "k1": 0.0578, "k2": -0.08,
 "p1": -0.00098, "p2": 0.00016, "cx": 138.6, "cy": 241.3, "w": 270.0, "h": 480.0, "aabb_scale": 4, "frames": [
 {"file_path": "images/0001.png", "sharpness": 31.75, "transform_matrix": [[0.6, -0.8, 0, 3.1], [0.8, 0.6, 0, -5.4],
  [0, 0, 1, -0.97], [0.0, 0.0, 0.0, 1.0]]},
 {"file_path": "./b", "fl_x": 300, "k3": 0.01, "k6": 0.02, "is_fisheye": 0, "camera_model": "FULL_OPENCV",
  "mask_path": "m.png", "transform_matrix": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]}],
 "train_filenames": ["b"]})";

std::string safetensors_file() {
  const std::string header =
      R"({"__metadata__":{"format":"a"},"w":{"dtype":"F32","shape":[2,3],"data_offsets":[0,24]},)"
      R"("h":{"dtype":"BF16","shape":[4],"data_offsets":[24,32]},"b":{"dtype":"U8","shape":[],"data_offsets":[32,33]}})";
  return packed(static_cast<std::uint64_t>(header.size())) + header + std::string(33, '\x3F');
}

// Also uses a lens that was read, on a small image.
void use(const Intrinsics& i) {
  const Camera c = i.camera({}, i.width, i.height).scaled(16, 12);
  const Crop part = covered_part(c, i.lens);
  undistorted_image(Tensor<float>(Shape{12, 16, 4}), c, i.lens, part);
  const NearestPixels nearest = nearest_pixels(c, i.lens, cropped(c, part));
  for (const auto& offset : *nearest.offsets)
    if (!std::isfinite(offset[0]) || !std::isfinite(offset[1]))
      throw std::logic_error("an offset is not finite");
}
void use(const SafetensorsFile& file) {
  for (const auto& t : file.tensors)
    if (t.dtype == "F32" || t.dtype == "BF16" || t.dtype == "F16") file.f32(t.name);
}

std::string text_of(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}
auto bytes_of(const std::string& text) { return std::as_bytes(std::span(text)); }

// A file in memory, for readers that take a path.
class MemoryFile {
 public:
  MemoryFile() : file_(::memfd_create("input", 0)) {
    if (file_ < 0) throw IoError("memfd_create failed");
  }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;
  ~MemoryFile() { ::close(file_); }
  std::filesystem::path holding(const std::string& bytes) const {
    if (::ftruncate(file_, 0) != 0 ||
        ::pwrite(file_, bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size()))
      throw IoError("the file in memory cannot be written");
    return "/proc/self/fd/" + std::to_string(file_);
  }

 private:
  int file_;
};

// Returns the bytes of the file that `write` writes to a path.
template <class Write>
std::string written(Write write) {
  const TemporaryFolder folder;
  write(folder / "file");
  return text_of(read_bytes(folder / "file"));
}

std::string png(Index channels) {
  return written([&](const auto& path) { write_png(path, Tensor<float>(Shape{5, 4, channels}, 0.4f)); });
}
std::string jpeg(Index channels, int quality) {
  return text_of(encode_jpeg(Tensor<float>(Shape{20, 18, channels}, 0.4f), quality));
}

std::string turned(int orientation, bool big) {
  return text_of(with_orientation(encode_jpeg(Tensor<float>(Shape{4, 4, 3}, 0.4f), 50), orientation, big));
}

std::string webp(Index channels, int quality) {
  return text_of(encode_webp(Tensor<float>(Shape{20, 18, channels}, 0.4f), quality));
}

std::string mp4() {
  VideoWriter writer(32, 16, {.crf = 20, .frames_per_second = 10});
  for (int k = 0; k < 3; ++k) writer.add(clip_frame(k));
  return text_of(writer.finish());
}

// The runs that checkpoints are read for.
struct FieldRun {
  RadianceField field = small_field();
  Dataset data = make_scene({.kind = SceneKind::sphere, .size = 16, .views = 2});
  Trainer trainer{field, data, {.schedule = {.steps = 2}}};
};
struct BakeRun {
  watermark::Owner owner = small_owner();
  watermark::Message message{{1, 0, 1}};
  watermark::Baker baker{owner, message, {.schedule = {.steps = 2}, .cameras = 2, .guide_views = 1}};
};
struct EmbedRun {
  watermark::Owner owner = small_owner();
  std::vector<watermark::CachedView> views =
      watermark::cache_novel_views(owner.field, watermark::square_patch(32), 2, 3);
  watermark::Embedder embedder{owner, views, {.schedule = {.steps = 2}, .batch = 1}};
};

template <class Parse>
std::function<void(const std::string&)> both(Parse parse, ColmapFormat format) {
  return [=](const std::string& bytes) { parse(bytes, format, "input"); };
}

// Returns the formats whose libraries this build has.
std::vector<Format> media_formats() {
  const auto image = [](const std::string& b) { decode_image(bytes_of(b), "input"); };
  std::vector<Format> formats;
  if (is_built_in(ImageFormat::webp)) formats.push_back({"webp", {webp(3, 50), webp(4, 90)}, image});
  if (is_built_in(ImageFormat::avif))
    formats.push_back({"avif",
                       {text_of(from_base64(kAvif)), text_of(from_base64(kAvifTurned)),
                        text_of(from_base64(kAvifDeep)), text_of(from_base64(kAvifAlpha))},
                       image});
  if (is_built_in(ImageFormat::heic))
    formats.push_back({"heic", {text_of(from_base64(kHeic)), text_of(from_base64(kHeicDeep))}, image});
  if (has_video())
    formats.push_back({"video",
                       {mp4(), text_of(from_base64(kWebm)), text_of(from_base64(kMovTurned)),
                        text_of(from_base64(kMovVariable))},
                       [](const std::string& b) {
                         VideoReader video(bytes_of(b), "input");
                         for (const double time : video.sample_times(3)) video.read_at(time);
                         video.oddity();
                       }});
  return formats;
}

// A file of readings of one owner with 3 cells.
cli::KeptReadings readings_in(const std::filesystem::path& path) { return {path, "owner", "auto", 3}; }
std::string readings() {
  return written([](const auto& path) {
    cli::KeptReadings kept = readings_in(path);
    for (const char* hash : {"aa", "bb"}) {
      cli::ImageEvidence read;
      read.sha256 = hash, read.width = 40, read.height = 30, read.cells = {0.5, -1.25, 3};
      kept.add(read);
    }
  });
}

}  // namespace

std::vector<Format> formats() {
  constexpr auto kText = ColmapFormat::text, kBinary = ColmapFormat::binary;
  const auto cameras = [](const std::string& bytes, ColmapFormat format, const char* name) {
    for (const auto& [key, camera] : parse_colmap_cameras(bytes, format, name)) use(camera);
  };
  const auto saved = [](const auto& model) { return written([&](const auto& path) { model.save(path); }); };
  RadianceField mlp(small_mlp_options());
  mlp.cameras = small_field().cameras;
  const auto file = std::make_shared<MemoryFile>();
  const auto embed_run = std::make_shared<EmbedRun>();
  const auto field_run = std::make_shared<FieldRun>();
  const auto bake_run = std::make_shared<BakeRun>();
  const std::string npy = npy_file("{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3), }",
                                   packed<float>({1, 2, 3, 4, 5, 6}), 2);
  std::vector<Format> all{
      {"npy", {npy, llff_file(llff_rows(1))}, [](const std::string& b) { parse_npy(b, "input"); }},
      {"poses_bounds.npy",
       {llff_file(llff_rows(2)), llff_file(llff_rows(3))},
       [](const std::string& b) {
         auto views = parse_poses_bounds(b, "input");
         recentre_llff(views);
       }},
      {"cameras.txt", {kColmapCamerasText}, both(cameras, kText)},
      {"cameras.bin", {colmap_cameras_binary()}, both(cameras, kBinary)},
      {"images.txt", {kColmapImagesText}, both(parse_colmap_images, kText)},
      {"images.bin", {colmap_images_binary()}, both(parse_colmap_images, kBinary)},
      {"transforms.json",
       {kTransforms},
       [](const std::string& b) {
         for (const auto& frame : parse_transforms(b, "input").frames)
           if (frame.intrinsics.width > 0) use(frame.intrinsics);
       }},
      {"camera path",
       {kTransforms},
       [=](const std::string& b) {
         for (const auto& camera : cli::read_camera_path(file->holding(b), CameraSpan{}, 8))
           for (const double number : camera.parameters())
             if (!std::isfinite(number)) throw std::logic_error("a camera is not finite");
       }},
      {"safetensors",
       {safetensors_file()},
       [](const std::string& b) { use(SafetensorsFile::parse(bytes_of(b), "input")); }},
      {"FIELD",
       {saved(small_field()), saved(mlp)},
       [=](const std::string& b) { RadianceField::load(file->holding(b)); },
       true},
      {"OWNER",
       {saved(small_owner()), saved(small_paper_owner())},
       [=](const std::string& b) { watermark::Owner::load(file->holding(b)); },
       true},
      {"KEY",
       {written([](const auto& path) { watermark::save_key(path, test_key(5)); })},
       [=](const std::string& b) { watermark::load_key(file->holding(b)); },
       true},
      {"train checkpoint",
       {saved(field_run->trainer)},
       [=](const std::string& b) {
         field_run->trainer.restore(file->holding(b));
         field_run->trainer.curve();
       },
       true},
      {"bake checkpoint",
       {saved(bake_run->baker)},
       [=](const std::string& b) {
         bake_run->baker.restore(file->holding(b));
         bake_run->baker.curve();
       },
       true},
      {"embed checkpoint",
       {saved(embed_run->embedder)},
       [=](const std::string& b) {
         const auto path = file->holding(b);
         watermark::Embedder::checkpoint_key(path);
         embed_run->embedder.restore(path);
         embed_run->embedder.curve();
       },
       true},
      {"png",
       {png(1), png(2), png(3), png(4)},
       [](const std::string& b) { decode_image(bytes_of(b), "input"); }},
      {"jpeg", {jpeg(1, 50), jpeg(3, 90)}, [](const std::string& b) { decode_image(bytes_of(b), "input"); }},
      {.name = "exif",
       .samples = {turned(3, false), turned(8, true)},
       .read =
           [](const std::string& b) {
             image_oddity(bytes_of(b));
             const int orientation = exif_orientation(bytes_of(b));
             if (orientation < 1 || orientation > 8) throw std::logic_error("no orientation");
           },
       .refuses = false},
      {"readings",
       {readings()},
       [=](const std::string& b) {
         try {
           readings_in(file->holding(b));
         } catch (const cli::UsageError& e) {  // of another owner or detection
           throw IoError(e.what());
         }
       }},
      // Converted to its canonical form first: otherwise nearly every mutation would fail that check.
      {"evidence.json",
       {watermark::evidence_json(small_evidence(), watermark::public_key(test_key(5)),
                                 {{"report.html", "f"}})},
       [](const std::string& b) {
         watermark::parse_evidence(watermark::canonical_json(b, "input"), "input");
       }},
  };
  for (auto& format : media_formats()) all.push_back(std::move(format));
  return all;
}
