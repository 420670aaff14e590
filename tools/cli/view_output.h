#pragma once
#include <fieldmark/imaging/video/video_writer.h>
#include <fieldmark/nerf/renderer.h>

#include <filesystem>
#include <future>
#include <memory>
#include <string>

namespace fieldmark::cli {

/// Returns the image of a rendering with its opacity as a fourth channel, and colours without the background.
/// @return [height, width, 4]; colours are 0 where the opacity is 0
Tensor<float> with_alpha(const nerf::Rendering& view, nerf::Background background);

/// True if a path names an MP4 file rather than a folder.
bool is_video_path(const std::string& path);

/// Takes rendered views one after another: PNG files of a folder, or frames of an MP4 file. A file is written
/// on a thread of its own while the next view is rendered; with one thread, at once.
class ViewOutput {
 public:
  /// @param out  folder, or path of an MP4 file   @param width, height  of all frames of the MP4 file
  /// @throws ValueError if this build cannot encode H.264, or frames of this size
  ViewOutput(std::filesystem::path out, Index width, Index height, double frames_per_second);
  ~ViewOutput();
  /// Adds the next view. Waits for the previous one and rethrows its error.
  /// @return the file that it is in   @throws IoError
  std::filesystem::path add(const std::string& name, Tensor<float> image);
  /// Completes the output; must be the last call. Without it, an MP4 file is not written. @throws IoError
  void finish();

 private:
  void wait();
  std::filesystem::path out_;
  std::unique_ptr<VideoWriter> video_;
  std::future<void> last_;
};

}  // namespace fieldmark::cli
