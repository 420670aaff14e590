#pragma once
#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <fieldmark/core/files.h>

#include <cstdlib>
#include <filesystem>
#include <functional>
#include <string>

#include "support/catch.h"

/// A file lock, held by one process at a time and released at the end of the scope.
struct FileLock {
  explicit FileLock(const std::filesystem::path& path) : file(::open(path.c_str(), O_CREAT | O_RDWR, 0600)) {
    REQUIRE(file >= 0);
    REQUIRE(::flock(file, LOCK_EX) == 0);
  }
  FileLock(const FileLock&) = delete;
  FileLock& operator=(const FileLock&) = delete;
  ~FileLock() { ::close(file); }
  int file;
};

/// Makes files that many tests need and that take long to make. Each test runs in its own process, so if
/// FIELDMARK_KEPT names a folder, the first process of a test program makes the files and keeps them there
/// below `name`; the others copy them.
/// @param folder  exists; receives the files   @param make  writes them into `folder`
inline void kept_files(const std::string& name, const std::filesystem::path& folder,
                       const std::function<void()>& make) {
  namespace fs = std::filesystem;
  const char* all = std::getenv("FIELDMARK_KEPT");
  if (!all) return make();
  // Changes with every build of the program.
  const fs::path self = fs::read_symlink("/proc/self/exe");
  const std::string program = self.string() + " " + std::to_string(fs::file_size(self)) + " " +
                              std::to_string(fs::last_write_time(self).time_since_epoch().count());
  const fs::path kept = fs::path(all) / name, done = kept / "of";
  fs::create_directories(kept.parent_path());
  const FileLock lock(kept.string() + ".lock");
  if (!fs::exists(done) || fieldmark::read_text(done) != program) {
    fs::remove_all(kept);
    make();
    fs::copy(folder, kept, fs::copy_options::recursive);
    fieldmark::write_file_atomically(done, program);
  } else {
    fs::copy(kept, folder, fs::copy_options::recursive);
    fs::remove(folder / "of");
  }
}
