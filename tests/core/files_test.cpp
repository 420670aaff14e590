#include <fieldmark/core/error.h>
#include <fieldmark/core/files.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <csignal>
#include <string>
#include <vector>

#include "support/catch.h"
#include "support/temporary_folder.h"

using namespace fieldmark;
namespace fs = std::filesystem;

namespace {
/// Simulates, for one file, a disk that is full after `bytes`.
struct FullDisk {
  rlimit before{};
  void (*handler)(int);
  explicit FullDisk(rlim_t bytes) : handler(std::signal(SIGXFSZ, SIG_IGN)) {
    getrlimit(RLIMIT_FSIZE, &before);
    const rlimit small{bytes, before.rlim_max};
    setrlimit(RLIMIT_FSIZE, &small);
  }
  FullDisk(const FullDisk&) = delete;
  FullDisk& operator=(const FullDisk&) = delete;
  ~FullDisk() {
    setrlimit(RLIMIT_FSIZE, &before);
    std::signal(SIGXFSZ, handler);
  }
};
}  // namespace

TEST_CASE("files: what is written is read, of any size, zero bytes included") {
  const TemporaryFolder folder;
  for (std::size_t size : {0u, 1u, 4095u, 4096u, 100000u}) {
    std::vector<std::byte> bytes(size);
    for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<std::byte>(i * 7 % 256);
    write_file_atomically(folder / "a", bytes);
    CHECK(read_bytes(folder / "a") == bytes);
  }
  write_file_atomically(folder / "a", "two\nlines");
  CHECK(read_text(folder / "a") == "two\nlines");
  CHECK(folder.entries() == 1);
}

TEST_CASE("files: nothing changes before commit, and a file that is not committed leaves no trace") {
  const TemporaryFolder folder;
  write_file_atomically(folder / "a", "old");
  {
    AtomicFile file(folder / "a");
    file.write(std::as_bytes(std::span(std::string_view("half of the new"))));
    CHECK(read_text(folder / "a") == "old");
    CHECK(folder.entries() == 2);
  }
  CHECK(read_text(folder / "a") == "old");
  CHECK(folder.entries() == 1);
}

TEST_CASE("files: a secret file is its owner's alone at every moment, whatever the umask") {
  const TemporaryFolder folder;
  const auto only_mine = [&] {
    CHECK(folder.entries() == 1);
    for (const auto& entry : fs::directory_iterator(folder.path))
      CHECK(entry.status().permissions() == static_cast<fs::perms>(0600));
  };
  const mode_t mask = ::umask(0);
  {
    AtomicFile file(folder / "a", Access::secret);
    only_mine();
    file.write(std::as_bytes(std::span(std::string_view("key"))));
    only_mine();
    file.commit();
  }
  ::umask(mask);
  only_mine();
  CHECK(read_text(folder / "a") == "key");
}

TEST_CASE("files: a full disk is an error that keeps the old file") {
  const TemporaryFolder folder;
  const std::string path = (folder / "a").string();
  write_file_atomically(path, "old");
  {
    const FullDisk disk(1000);
    CHECK_THROWS_WITH(write_file_atomically(path, std::string(5000, 'x')),
                      "[write] " + path + ": write failed at byte 1000: File too large");
    CHECK_THROWS_AS(write_file_atomically(path, std::string(5000, 'x')), IoError);
  }
  CHECK(read_text(path) == "old");
  CHECK(folder.entries() == 1);
  CHECK_THROWS_WITH(write_file_atomically("/dev/full", "x"),
                    "[write] /dev/full: write failed at byte 0: No space left on device");
}

TEST_CASE("files: errors name the path and the system's reason") {
  const TemporaryFolder folder;
  const std::string missing = (folder / "no/such/file").string();
  CHECK_THROWS_WITH(read_text(missing), "[read] " + missing + ": open failed: No such file or directory");
  CHECK_THROWS_WITH(read_bytes(folder.path), Contains("read failed: Is a directory"));
  CHECK_THROWS_WITH(write_file_atomically(missing, "x"),
                    Contains(missing) && Contains("No such file or directory"));
  fs::create_directory(folder / "b");
  CHECK_THROWS_WITH(AtomicFile(folder / "b"), Contains("expected a file to write, found a folder"));
  CHECK(folder.entries() == 1);
}

TEST_CASE("files: links are followed, permissions are the umask's, pipes and devices are read and written") {
  const TemporaryFolder folder;
  write_file_atomically(folder / "target", "old");
  fs::create_symlink(folder / "target", folder / "link");
  write_file_atomically(folder / "link", "new");
  CHECK(fs::is_symlink(folder / "link"));
  CHECK(read_text(folder / "target") == "new");
  fs::create_symlink("later", folder / "second");  // to a file that does not exist yet
  fs::create_symlink(folder / "second", folder / "first");
  write_file_atomically(folder / "first", "made");
  CHECK(fs::is_symlink(folder / "first"));
  CHECK(fs::is_symlink(folder / "second"));
  CHECK(read_text(folder / "later") == "made");
  fs::create_symlink("circle", folder / "circle");
  CHECK_THROWS_WITH(write_file_atomically(folder / "circle", "x"),
                    Contains("a symbolic link that leads nowhere"));
  CHECK(fs::is_symlink(folder / "circle"));
  const mode_t mask = ::umask(0027);
  write_file_atomically(folder / "masked", "x");
  ::umask(mask);
  CHECK(fs::status(folder / "masked").permissions() == static_cast<fs::perms>(0640));
  CHECK(read_text("/proc/self/stat").find('(') != std::string::npos);
  CHECK_NOTHROW(write_file_atomically("/dev/null", "x"));
}
