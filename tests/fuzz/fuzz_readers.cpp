// Feeds mutations of valid files to the readers of foreign formats: each must be read or refused with an
// Error.
//   fuzz_readers [INPUTS = 20000] [SEED = 1] [FIRST = 0] [FORMAT = all of them, by turns]
// Input i depends only on SEED, i and FORMAT, so `fuzz_readers 1 SEED i FORMAT` repeats one. The sanitizers
// (preset asan) detect crashes and leaks.
#include <fieldmark/core/error.h>
#include <fieldmark/core/files.h>
#include <fieldmark/engine/safetensors.h>
#include <fieldmark/imaging/exif.h>
#include <fieldmark/imaging/image.h>
#include <fieldmark/imaging/image_format.h>
#include <fieldmark/imaging/video/video_reader.h>
#include <fieldmark/imaging/video/video_writer.h>
#include <fieldmark/watermark/embedding/embedder.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <functional>
#include <iostream>
#include <limits>
#include <map>
#include <memory>
#include <random>

#include "canonical_json.h"
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
using Random = std::mt19937_64;
constexpr double kSecondsForOne = 2;
constexpr rlim_t kMemory = rlim_t{2} << 30;  // a file of kilobytes must not need more

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
  for (const auto& offset : *nearest_pixels(c, i.lens, cropped(c, part)).offsets)
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

// The embed run that a checkpoint is read for.
struct EmbedRun {
  watermark::Owner owner = small_owner();
  std::vector<watermark::CachedView> views =
      watermark::cache_novel_views(owner.field, watermark::square_patch(32), 2, 3);
  watermark::Embedder embedder{owner, views, {.schedule = {.steps = 2}, .batch = 1}};
};

struct Format {
  const char* name;
  std::vector<std::string> samples;
  std::function<void(const std::string&)> read;
  bool safetensors = false;  ///< mutate only the header, and update its length
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

std::vector<Format> formats() {
  constexpr auto kText = ColmapFormat::text, kBinary = ColmapFormat::binary;
  const auto cameras = [](const std::string& bytes, ColmapFormat format, const char* name) {
    for (const auto& [key, camera] : parse_colmap_cameras(bytes, format, name)) use(camera);
  };
  const auto saved = [](const auto& model) { return written([&](const auto& path) { model.save(path); }); };
  RadianceField mlp(small_mlp_options());
  mlp.cameras = small_field().cameras;
  const auto file = std::make_shared<MemoryFile>();
  const auto run = std::make_shared<EmbedRun>();
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
      {"checkpoint",
       {saved(run->embedder)},
       [=](const std::string& b) {
         const auto path = file->holding(b);
         watermark::Embedder::checkpoint_key(path);
         run->embedder.restore(path);
       },
       true},
      {"png",
       {png(1), png(2), png(3), png(4)},
       [](const std::string& b) { decode_image(bytes_of(b), "input"); }},
      {"jpeg", {jpeg(1, 50), jpeg(3, 90)}, [](const std::string& b) { decode_image(bytes_of(b), "input"); }},
      {"exif",
       {turned(3, false), turned(8, true)},
       [](const std::string& b) {
         image_oddity(bytes_of(b));
         const int orientation = exif_orientation(bytes_of(b));
         if (orientation < 1 || orientation > 8) throw std::logic_error("no orientation");
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

std::string number(Random& random) {
  static const std::string words[] = {
      "0",     "-1",    "1e308",      "-1e-308", "nan",  "inf", "18446744073709551616",
      "2.5e9", "1e999", "0x7fffffff", "65537",   "[",    "]",   "{",
      "}",     "\"",    ",",          ":",       "null", "\n",  "\\u0000"};
  static const std::string bytes[] = {packed(std::numeric_limits<std::uint64_t>::max()),
                                      packed(std::numeric_limits<std::int64_t>::min()),
                                      packed(std::numeric_limits<double>::quiet_NaN()),
                                      packed(std::numeric_limits<double>::infinity()),
                                      packed(std::numeric_limits<double>::denorm_min()),
                                      packed(1e300),
                                      packed(std::uint64_t{1} << 40),
                                      packed(std::uint64_t{0}),
                                      packed(std::uint32_t{0x80000000})};
  return random() % 2 ? words[random() % std::size(words)] : bytes[random() % std::size(bytes)];
}

void mutate(std::string& s, const std::string& other, Random& random) {
  if (s.empty()) {
    s = number(random);
    return;
  }
  const std::size_t at = random() % s.size(), length = 1 + random() % 40;
  switch (random() % 8) {
    case 0:
      s[at] = static_cast<char>(s[at] ^ (1 << random() % 8));
      break;
    case 1:
      s[at] = static_cast<char>(random());
      break;
    case 2:
      s.resize(at);
      break;
    case 3:
      s.erase(at, length);
      break;
    case 4:
      s.insert(at, number(random));
      break;
    case 5: {
      const std::string by = number(random);
      s.replace(at, by.size(), by);
      break;
    }
    case 6:
      s.insert(at, s.substr(random() % s.size(), length));
      break;
    default:
      s.replace(at, length, other.substr(random() % other.size(), 1 + random() % 40));
  }
}

// Mutates the header of a safetensors file and updates its length, so that the data still fits.
void mutate_header(std::string& s, const std::string& other, Random& random) {
  std::uint64_t length = 0;
  std::memcpy(&length, s.data(), sizeof length);
  std::string header = s.substr(sizeof length, length);
  mutate(header, other, random);
  s = packed(static_cast<std::uint64_t>(header.size())) + header + s.substr(sizeof length + length);
}

struct Outcome {
  std::size_t read = 0, refused = 0;
};

// Returns false if it threw something other than an Error, or took too long.
bool try_one(const Format& format, const std::string& input, Outcome& outcome) {
  const std::clock_t begin = std::clock();  // time of this process: others may use the CPU
  try {
    format.read(input);
    ++outcome.read;
  } catch (const Error&) {
    ++outcome.refused;
  } catch (const std::exception& e) {
    std::cerr << format.name << ": not an Error: " << e.what() << "\n";
    return false;
  } catch (...) {
    std::cerr << format.name << ": not an exception\n";
    return false;
  }
  const double seconds = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
  if (seconds > kSecondsForOne) std::cerr << format.name << ": took " << seconds << " s\n";
  return seconds <= kSecondsForOne;
}

// only: name of a format; empty: all of them, by turns
int run(std::size_t inputs, std::uint64_t seed, std::size_t first, const std::string& only) {
  std::vector<Format> all = formats();
  if (!only.empty()) std::erase_if(all, [&](const Format& f) { return f.name != only; });
  if (all.empty()) {
    std::cerr << only << ": no such format, or this build lacks its library\n";
    return 2;
  }
  std::vector<Outcome> outcomes(all.size());
  for (std::size_t k = 0; k < all.size(); ++k)
    for (const auto& sample : all[k].samples)
      all[k].read(sample);  // valid: an exception here ends the program
  std::size_t failures = 0;
  for (std::size_t i = first; i < first + inputs; ++i) {
    std::seed_seq words{seed, seed >> 32, std::uint64_t{i}, std::uint64_t{i} >> 32};
    Random random(words);
    const std::size_t k = i % all.size();
    const Format &format = all[k], &other = all[random() % all.size()];
    std::string input = format.samples[random() % format.samples.size()];
    const bool header = format.safetensors && random() % 8 != 0;
    for (auto edits = 1 + random() % 3; edits > 0; --edits)
      (header ? mutate_header : mutate)(input, other.samples[0], random);
    if (!try_one(format, input, outcomes[k])) {
      std::cerr << "  input " << i << ": repeat with fuzz_readers 1 " << seed << " " << i << " " << only
                << "\n";
      ++failures;
    }
  }
  for (std::size_t k = 0; k < all.size(); ++k)
    std::cout << all[k].name << ": " << outcomes[k].read << " read, " << outcomes[k].refused << " refused\n";
  std::cout << inputs << " inputs, " << failures << " failures\n";
  return failures == 0 ? 0 : 1;
}
}  // namespace

int main(int count, char** words) {
#ifndef __SANITIZE_ADDRESS__  // which maps terabytes; there ASAN_OPTIONS=max_allocation_size_mb bounds an
                              // allocation
  const rlimit memory{kMemory, kMemory};
  ::setrlimit(RLIMIT_AS, &memory);
#endif
  for (int i = 1; i < count && i < 4; ++i)
    if (std::string(words[i]).find_first_not_of("0123456789") != std::string::npos) {
      std::cerr << words[i] << ": expected a number; a format is the fourth argument\n";
      return 2;
    }
  const auto argument = [&](int i, unsigned long long otherwise) {
    return i < count ? std::strtoull(words[i], nullptr, 10) : otherwise;
  };
  return run(argument(1, 20000), argument(2, 1), argument(3, 0), count > 4 ? words[4] : "");
}
