#include "ffmpeg_functions.h"

#include <fieldmark/core/error.h>

#include <cstdio>
#include <filesystem>

#include "imaging/video/video_samples.h"
#include "support/catch.h"

#ifdef FIELDMARK_WITH_VIDEO
using namespace fieldmark;

namespace {
// Returns the libraries that the loader loads with a program, by name.
std::string libraries_of(const std::filesystem::path& program) {
  const std::string command = "LD_TRACE_LOADED_OBJECTS=1 '" + program.string() + "'";
  std::FILE* pipe = ::popen(command.c_str(), "r");
  REQUIRE(pipe);
  std::string all;
  for (int c = std::fgetc(pipe); c != EOF; c = std::fgetc(pipe)) all.push_back(static_cast<char>(c));
  REQUIRE(::pclose(pipe) == 0);
  return all;
}
}  // namespace

TEST_CASE("ffmpeg_functions: the libraries are loaded by a call, not with the program") {
  const std::string libraries = libraries_of(std::filesystem::read_symlink("/proc/self/exe"));
  CHECK(libraries.find("libc.so") != std::string::npos);
  CHECK(libraries.find("libavcodec") == std::string::npos);
  if (!video_or_skip()) return;
  CHECK(std::string(ffmpeg::av_get_media_type_string(AVMEDIA_TYPE_VIDEO)) == "video");
}

TEST_CASE("ffmpeg_functions: a function that no library has is named") {
  if (!video_or_skip()) return;
  CHECK_THROWS_WITH(ffmpeg::address(ffmpeg::Library::scale, "sws_of_tomorrow"),
                    "[video] FFmpeg's libraries lack sws_of_tomorrow; install libavformat-dev libavcodec-dev "
                    "libswscale-dev and build again");
}
#endif
