#pragma once
#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <fieldmark/core/files.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tools/test_key_file.h"
#include "tools/tiny_scene.h"

/// Embeds messages of 4 bits in a field in two steps: too few to read anything. The key is a known one, so
/// that the owner is the same in every run.
inline Outcome tiny_embed(const std::string& field, const std::string& owner,
                          const std::vector<std::string>& more) {
  std::vector<std::string> words{"embed", "--field",       field, "--out",   owner, "--bits",  "4", "--cells",
                                 "6",     "--reader-size", "32",  "--steps", "2",   "--views", "8"};
  words.insert(words.end(), more.begin(), more.end());
  const TemporaryFolder folder;
  if (std::find(more.begin(), more.end(), "--key") == more.end())
    words.insert(words.end(), {"--key", test_key_file(folder)});
  return run_command(words);
}

/// A field and an owner of 4-bit messages, made once: too little training to read anything, enough to run
/// every path. Tests run as processes of their own, so where FIELDMARK_TINY_JOB names
/// a folder, the first process of this program keeps the files there and the others copy them.
struct TinyJob {
  TemporaryFolder folder;
  std::string scene = folder / "scene", field = folder / "field.fm", owner = folder / "owner.fm";
  nlohmann::json embedded;

  static const TinyJob& get() {
    static const TinyJob job;
    return job;
  }
  /// Two images of the field, in a folder.
  std::string images() const {
    const std::string out = folder / "views";
    if (std::filesystem::exists(out)) return out;
    const auto r = run_command({"render", "--field", field, "--out", out, "--count", "2", "--size", "32"});
    INFO(r.err);
    REQUIRE(r.code == 0);
    return out;
  }

 private:
  // Held by one process at a time, and let go when it ends.
  struct Lock {
    explicit Lock(const std::filesystem::path& path) : file(::open(path.c_str(), O_CREAT | O_RDWR, 0600)) {
      REQUIRE(file >= 0);
      REQUIRE(::flock(file, LOCK_EX) == 0);
    }
    Lock(const Lock&) = delete;
    Lock& operator=(const Lock&) = delete;
    ~Lock() { ::close(file); }
    int file;
  };

  TinyJob() {
    namespace fs = std::filesystem;
    if (const char* name = std::getenv("FIELDMARK_TINY_JOB")) {
      const fs::path kept = name, done = kept / "of";
      fs::create_directories(kept.parent_path());
      const Lock lock(kept.string() + ".lock");
      if (!fs::exists(done) || fieldmark::read_text(done) != program()) {
        fs::remove_all(kept);
        make();
        fs::copy(folder.path, kept, fs::copy_options::recursive);
        fieldmark::write_file_atomically(done, program());
      } else {
        fs::copy(kept, folder.path, fs::copy_options::recursive);
        fs::remove(folder / "of");
      }
    } else {
      make();
    }
    embedded = nlohmann::json::parse(fieldmark::read_text(folder / "embedded.json"));
    std::filesystem::remove(folder / "embedded.json");
  }
  // Changes whenever the program is built anew.
  static std::string program() {
    const auto self = std::filesystem::read_symlink("/proc/self/exe");
    return self.string() + " " + std::to_string(std::filesystem::file_size(self)) + " " +
           std::to_string(std::filesystem::last_write_time(self).time_since_epoch().count());
  }
  void make() const {
    tiny_field(folder, tiny_scene(folder));
    const auto r = tiny_embed(
        field, owner, {"--measured-views", "2", "--distort", "blur_1", "--json", folder / "embedded.json"});
    INFO(r.err);
    REQUIRE(r.code == 0);
  }
};
