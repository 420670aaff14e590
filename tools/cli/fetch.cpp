#include "cli/fetch.h"

#include <curl/curl.h>
#include <fcntl.h>
#include <fieldmark/core/digest.h>
#include <fieldmark/core/error.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <memory>

namespace fieldmark::cli {
namespace {
namespace fs = std::filesystem;

constexpr long kConnectSeconds = 30, kStallSeconds = 60;

// One attempt to complete a partial file.
struct Transfer {
  CURL* curl = nullptr;
  int file = -1;
  std::uintmax_t begin = 0, have = 0, expected = 0;
  const FetchProgress* progress = nullptr;
  bool started = false, ended = false, too_long = false;
  int write_error = 0;
};

bool write_all(Transfer& t, const char* data, std::size_t size) {
  while (size > 0) {
    const auto n = ::write(t.file, data, size);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return t.write_error = errno, false;
    data += n, size -= static_cast<std::size_t>(n);
  }
  return true;
}

// Returning any value other than the size ends the transfer.
std::size_t on_bytes(const char* data, std::size_t, std::size_t size, void* user) {
  auto& t = *static_cast<Transfer*>(user);
  if (!t.started) {
    t.started = true;
    long status = 0;
    curl_easy_getinfo(t.curl, CURLINFO_RESPONSE_CODE, &status);
    // 206 is the requested range; 200 is the whole file, from a server without ranges.
    if (t.begin > 0 && status != 206) {
      if (::ftruncate(t.file, 0) != 0 || ::lseek(t.file, 0, SEEK_SET) < 0) return t.write_error = errno, 0;
      t.have = 0;
    }
  }
  if (size > t.expected - t.have) return t.too_long = true, 0;
  if (!write_all(t, data, size)) return 0;
  t.have += size;
  return size;
}

int on_progress(void* user, curl_off_t, curl_off_t, curl_off_t, curl_off_t) {
  auto& t = *static_cast<Transfer*>(user);
  t.ended = !(*t.progress)(t.have);
  return t.ended ? 1 : 0;
}

struct CloseCurl {
  void operator()(CURL* curl) const { curl_easy_cleanup(curl); }
};

CURLcode perform(Transfer& t, const std::string& url, char* reason) {
  static const CURLcode global = curl_global_init(CURL_GLOBAL_DEFAULT);
  const std::unique_ptr<CURL, CloseCurl> curl(global == CURLE_OK ? curl_easy_init() : nullptr);
  if (!curl) return CURLE_FAILED_INIT;
  t.curl = curl.get();
  const auto set = [&](CURLoption option, auto value) { curl_easy_setopt(curl.get(), option, value); };
  set(CURLOPT_URL, url.c_str());
  set(CURLOPT_PROTOCOLS_STR, "http,https");
  set(CURLOPT_REDIR_PROTOCOLS_STR, "http,https");
  set(CURLOPT_FOLLOWLOCATION, 1L);
  set(CURLOPT_MAXREDIRS, 10L);
  set(CURLOPT_FAILONERROR, 1L);
  set(CURLOPT_NOSIGNAL, 1L);
  set(CURLOPT_CONNECTTIMEOUT, kConnectSeconds);
  set(CURLOPT_LOW_SPEED_LIMIT, 1L);
  set(CURLOPT_LOW_SPEED_TIME, kStallSeconds);
  set(CURLOPT_USERAGENT, "fieldmark");
  set(CURLOPT_ERRORBUFFER, reason);
  set(CURLOPT_WRITEFUNCTION, &on_bytes);
  set(CURLOPT_WRITEDATA, &t);
  set(CURLOPT_NOPROGRESS, 0L);
  set(CURLOPT_XFERINFOFUNCTION, &on_progress);
  set(CURLOPT_XFERINFODATA, &t);
  const std::string range = std::to_string(t.begin) + "-";
  if (t.begin > 0) set(CURLOPT_RANGE, range.c_str());
  return curl_easy_perform(curl.get());
}

std::uintmax_t size_of(const fs::path& path) {
  std::error_code error;
  const auto bytes = fs::file_size(path, error);
  return error ? 0 : bytes;
}

struct OpenFile {
  int fd;
  explicit OpenFile(const fs::path& path) : fd(::open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0644)) {
    if (fd < 0 || ::lseek(fd, 0, SEEK_END) < 0)
      throw IoError(path.string() + ": cannot be written: " + std::strerror(errno));
  }
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;
  ~OpenFile() {
    if (fd >= 0) ::close(fd);
  }
};

// Continues the partial file from its end. @return false if progress stopped it
bool fill(const std::string& url, const fs::path& part, const Manifest::File& expected,
          const FetchProgress& progress) {
  if (size_of(part) > expected.bytes) fs::remove(part);
  const OpenFile file(part);
  const std::uintmax_t begin = size_of(part);
  if (begin == expected.bytes) return true;
  char reason[CURL_ERROR_SIZE] = "";
  Transfer t{
      .file = file.fd, .begin = begin, .have = begin, .expected = expected.bytes, .progress = &progress};
  const CURLcode code = perform(t, url, reason);
  if (t.ended) return false;
  if (t.write_error != 0)
    throw IoError(part.string() + ": cannot be written: " + std::strerror(t.write_error));
  if (t.too_long) {
    fs::remove(part);
    throw IoError(url + ": expected " + std::to_string(expected.bytes) + " bytes, got more");
  }
  if (code == CURLE_HTTP_RETURNED_ERROR) {
    // Status 416: the server's file ends before ours begins, so ours is not a part of it.
    if (std::string_view(reason).ends_with("416")) fs::remove(part);
    throw IoError(url + ": " + reason);
  }
  if (t.have != expected.bytes)
    throw IoError(url + ": expected " + std::to_string(expected.bytes) + " bytes, got " +
                  std::to_string(t.have) + " (" + (*reason ? reason : "the server sent no more") +
                  "); what came is kept, and the same command resumes");
  if (::fsync(file.fd) != 0) throw IoError(part.string() + ": cannot be written: " + std::strerror(errno));
  return true;
}

// Returns base_url + path with every byte that a URL path does not allow as %XX.
std::string address(const std::string& base, const std::string& path) {
  constexpr std::string_view kPlain = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-._~/";
  std::string url = base.ends_with('/') ? base : base + "/";
  for (const char c : path) {
    constexpr char kDigits[] = "0123456789ABCDEF";
    const auto byte = static_cast<unsigned char>(c);
    if (kPlain.find(c) != std::string_view::npos)
      url += c;
    else
      url += {'%', kDigits[byte >> 4], kDigits[byte & 15]};
  }
  return url;
}
}  // namespace

bool fetch_file(const std::string& url, const fs::path& to, const Manifest::File& expected,
                const FetchProgress& progress) {
  const fs::path part = to.string() + ".part";
  if (to.has_parent_path()) fs::create_directories(to.parent_path());
  try {
    if (!fill(url, part, expected, progress)) return false;
  } catch (...) {
    if (size_of(part) == 0) fs::remove(part);
    throw;
  }
  const std::string found = sha256_file_hex(part);
  if (found != expected.sha256) {
    fs::remove(part);
    throw IoError(url + ": expected sha256 " + expected.sha256 + ", got " + found + "; nothing was kept");
  }
  fs::rename(part, to);
  return true;
}

Fetched fetch_manifest(const Manifest& manifest, const fs::path& folder, const FetchProgress& progress) {
  if (manifest.base_url.empty())
    throw IoError(
        manifest.name + ": no address of its files is known; give --base-url URL, or get it by hand from " +
        manifest.url + ", then compare with: fieldmark data verify " + manifest.name + " " + folder.string());
  Fetched result;
  std::uintmax_t before = 0;
  for (const auto& file : manifest.files) {
    const fs::path to = folder / file.path;
    if (file_fault(file, to).empty()) {
      ++result.present;
    } else {
      result.complete = fetch_file(address(manifest.base_url, file.path), to, file,
                                   [&](std::uintmax_t bytes) { return progress(before + bytes); });
      if (!result.complete) return result;
      ++result.fetched;
    }
    before += file.bytes;
    if (!progress(before)) {
      result.complete = result.fetched + result.present == manifest.files.size();
      return result;
    }
  }
  return result;
}

}  // namespace fieldmark::cli
