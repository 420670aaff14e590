#include <fcntl.h>
#include <fieldmark/core/error.h>
#include <fieldmark/core/files.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdio>
#include <system_error>
#include <utility>

namespace fieldmark {
namespace fs = std::filesystem;
namespace {

std::string errno_text(int error) { return std::generic_category().message(error); }

bool is_device(const fs::path& path) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  return fs::exists(status) && !fs::is_regular_file(status) && !fs::is_directory(status);
}

// Resolves symbolic links, even to a file that does not exist yet.
fs::path resolve(const fs::path& path) {
  constexpr int kMostLinks = 40;
  if (is_device(path)) return path;  // the link of a pipe names no file
  std::error_code error;
  fs::path target = path;
  for (int links = 0; fs::is_symlink(target, error); ++links) {
    const fs::path next = fs::read_symlink(target, error);
    if (error || links == kMostLinks)
      throw IoError("[write] " + path.string() + ": a symbolic link that leads nowhere; name another file");
    target = target.parent_path() / next;  // keeps absolute targets
  }
  return target;
}

// Unlike mkstemp, respects the umask. The pid and a counter keep concurrent writers apart.
int open_temporary(const fs::path& target, mode_t mode, fs::path* temporary) {
  static std::atomic<unsigned> counter{0};
  for (;;) {
    *temporary = target;
    *temporary += ".tmp." + std::to_string(::getpid()) + "." + std::to_string(counter++);
    const int fd = ::open(temporary->c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, mode);
    if (fd >= 0 || errno != EEXIST) return fd;
  }
}

struct Descriptor {
  int fd;
  ~Descriptor() { ::close(fd); }
};

template <class Buffer>
Buffer read_all(const fs::path& path) {
  auto fail = [&](const char* what, int error) {
    throw IoError("[read] " + path.string() + ": " + what + " failed: " + errno_text(error));
  };
  const Descriptor file{::open(path.c_str(), O_RDONLY | O_CLOEXEC)};
  if (file.fd < 0) fail("open", errno);
  struct stat status {};
  if (::fstat(file.fd, &status) != 0) fail("stat", errno);
  Buffer buffer;
  // One byte more than the file has reveals its end without another resize; a pipe has size 0 and grows.
  buffer.resize(static_cast<std::size_t>(status.st_size) + 1);
  std::size_t used = 0;
  for (;;) {
    if (used == buffer.size()) buffer.resize(2 * used + 4096);
    const ssize_t n = ::read(file.fd, buffer.data() + used, buffer.size() - used);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) fail("read", errno);
    if (n == 0) break;
    used += static_cast<std::size_t>(n);
  }
  buffer.resize(used);
  return buffer;
}

}  // namespace

AtomicFile::AtomicFile(const fs::path& path, Access access) : path_(path), target_(resolve(path)) {
  if (is_device(target_)) {
    fd_ = ::open(target_.c_str(), O_WRONLY | O_CLOEXEC);
    if (fd_ < 0) fail("open", errno);
    return;
  }
  std::error_code unknown;
  if (fs::is_directory(target_, unknown))
    throw IoError("[write] " + path.string() + ": expected a file to write, found a folder; name a file");
  fd_ = open_temporary(target_, access == Access::secret ? 0600 : 0666, &temporary_);
  if (fd_ >= 0) return;
  const int error = errno;
  temporary_.clear();
  fail("making a temporary file beside it", error);
}

AtomicFile::~AtomicFile() {
  if (fd_ >= 0) ::close(fd_);
  if (!temporary_.empty()) ::unlink(temporary_.c_str());
}

void AtomicFile::fail(const char* what, int error) const {
  throw IoError("[write] " + path_.string() + ": " + what + " failed at byte " + std::to_string(written_) +
                ": " + errno_text(error));
}

void AtomicFile::write(std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t n = ::write(fd_, bytes.data(), std::min(bytes.size(), std::size_t{1} << 30));
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) fail("write", errno);
    written_ += static_cast<std::size_t>(n);
    bytes = bytes.subspan(static_cast<std::size_t>(n));
  }
}

void AtomicFile::commit() {
  if (!temporary_.empty() && ::fsync(fd_) != 0) fail("flush to the disk", errno);
  const int closed = ::close(std::exchange(fd_, -1));
  if (closed != 0) fail("close", errno);
  if (temporary_.empty()) return;
  if (std::rename(temporary_.c_str(), target_.c_str()) != 0) fail("rename", errno);
  temporary_.clear();
  // Flushing the folder makes the rename durable. Some file systems do not support this and flush it later.
  const fs::path folder = target_.has_parent_path() ? target_.parent_path() : fs::path(".");
  const int fd = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd < 0) return;
  ::fsync(fd);
  ::close(fd);
}

void write_file_atomically(const fs::path& path, std::span<const std::byte> bytes) {
  AtomicFile file(path);
  file.write(bytes);
  file.commit();
}

void write_file_atomically(const fs::path& path, std::string_view text) {
  write_file_atomically(path, std::as_bytes(std::span(text)));
}

std::vector<std::byte> read_bytes(const fs::path& path) { return read_all<std::vector<std::byte>>(path); }

std::string read_text(const fs::path& path) { return read_all<std::string>(path); }

}  // namespace fieldmark
