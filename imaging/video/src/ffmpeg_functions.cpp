#include "ffmpeg_functions.h"

#include <fieldmark/core/error.h>
#include <fieldmark/imaging/image_format.h>

#ifdef FIELDMARK_WITH_VIDEO
#include <dlfcn.h>
#endif

namespace fieldmark::ffmpeg {
namespace {

constexpr const char* kPackages = "libavformat-dev libavcodec-dev libswscale-dev";

#ifdef FIELDMARK_WITH_VIDEO
struct Loaded {
  void* libraries[4]{};
  std::string lack;
};

// The libraries stay loaded until the program ends: FFmpeg's threads and callbacks may outlive their caller.
const Loaded& loaded() {
  static const Loaded all = [] {
    // Only this version has the layout of FFmpeg's structures that Fieldmark was compiled with.
    const char* names[] = {"libavutil.so." AV_STRINGIFY(LIBAVUTIL_VERSION_MAJOR),
                           "libavcodec.so." AV_STRINGIFY(LIBAVCODEC_VERSION_MAJOR),
                           "libavformat.so." AV_STRINGIFY(LIBAVFORMAT_VERSION_MAJOR),
                           "libswscale.so." AV_STRINGIFY(LIBSWSCALE_VERSION_MAJOR)};
    Loaded result;
    for (std::size_t i = 0; i < std::size(names); ++i) {
      result.libraries[i] = ::dlopen(names[i], RTLD_NOW | RTLD_LOCAL);
      if (result.libraries[i]) continue;
      const char* why = ::dlerror();
      result.lack =
          std::string("videos need FFmpeg's libraries: ") + (why ? why : names[i]) + "; install " + kPackages;
      break;
    }
    return result;
  }();
  return all;
}
#endif

}  // namespace

#ifdef FIELDMARK_WITH_VIDEO
std::string lack() { return loaded().lack; }

void* address(Library library, const char* function) {
  const Loaded& all = loaded();
  if (!all.lack.empty()) throw Error("[video] " + all.lack);
  if (void* found = ::dlsym(all.libraries[static_cast<int>(library)], function)) return found;
  throw Error(std::string("[video] FFmpeg's libraries lack ") + function + "; install " + kPackages +
              " and build again");
}
#else
std::string lack() { return missing_library("videos", "FFmpeg's libraries", kPackages); }
#endif

}  // namespace fieldmark::ffmpeg
