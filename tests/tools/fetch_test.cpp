#include "cli/fetch.h"

#include <fieldmark/core/digest.h>
#include <fieldmark/core/error.h>
#include <fieldmark/core/files.h>

#include <nlohmann/json.hpp>

#include "cli/cli.h"
#include "support/catch.h"
#include "support/loopback_server.h"
#include "support/temporary_folder.h"
#include "tools/run_command.h"

using namespace fieldmark;
using namespace fieldmark::cli;
namespace fs = std::filesystem;

namespace {
std::string content(std::size_t bytes) {
  std::string text(bytes, ' ');
  for (std::size_t i = 0; i < bytes; ++i) text[i] = static_cast<char>('a' + i * i % 26);
  return text;
}
const std::string kFile = content(100'000);

Manifest::File expected(const std::string& path = "f") {
  return {path, kFile.size(), sha256_hex(std::string_view(kFile))};
}
std::string answer(const std::string& status, const std::string& body, const std::string& fields = "") {
  return "HTTP/1.1 " + status + "\r\n" + fields + "Content-Length: " + std::to_string(body.size()) +
         "\r\nConnection: close\r\n\r\n" + body;
}
// Returns the offset at which a request asks to begin.
std::size_t range_of(const std::string& request) {
  const auto at = request.find("Range: bytes=");
  return at == std::string::npos ? 0 : std::stoul(request.substr(at + 13));
}
std::string with_ranges(const std::string& request) {
  const auto begin = range_of(request);
  if (begin == 0) return answer("200 OK", kFile);
  return answer("206 Partial Content", kFile.substr(begin),
                "Content-Range: bytes " + std::to_string(begin) + "-" + std::to_string(kFile.size() - 1) +
                    "/" + std::to_string(kFile.size()) + "\r\n");
}
bool go_on(std::uintmax_t) { return true; }
}  // namespace

TEST_CASE("fetch_file brings a whole file and leaves no part", "[fetch]") {
  const TemporaryFolder folder;
  LoopbackServer server(with_ranges);
  std::uintmax_t last = 0;
  CHECK(fetch_file(server.url() + "f", folder / "below/f", expected(), [&](std::uintmax_t bytes) {
    CHECK(bytes >= last);
    last = bytes;
    return true;
  }));
  CHECK(read_text(folder / "below/f") == kFile);
  CHECK(!fs::exists(folder / "below/f.part"));
  REQUIRE(server.requests().size() == 1);
  CHECK(server.requests()[0].starts_with("GET /f HTTP/1.1\r\n"));
}

TEST_CASE("fetch_file goes on after a connection that was cut", "[fetch]") {
  const TemporaryFolder folder;
  bool cut = true;
  LoopbackServer server([&](const std::string& request) {
    const std::string whole = with_ranges(request);
    return cut ? whole.substr(0, whole.size() - 60'000) : whole;
  });
  const std::string url = server.url() + "f";
  CHECK_THROWS_WITH(
      fetch_file(url, folder / "f", expected(), go_on),
      Contains(url + ": expected 100000 bytes, got 40000 (") && Contains("the same command resumes"));
  CHECK(!fs::exists(folder / "f"));
  CHECK(fs::file_size(folder / "f.part") == 40'000);
  cut = false;
  CHECK(fetch_file(url, folder / "f", expected(), go_on));
  CHECK(read_text(folder / "f") == kFile);
  CHECK(range_of(server.requests().at(1)) == 40'000);
  CHECK(folder.entries() == 1);
}

TEST_CASE("fetch_file takes the whole file from a server that knows no ranges", "[fetch]") {
  const TemporaryFolder folder;
  LoopbackServer server([](const std::string&) { return answer("200 OK", kFile); });
  write_file_atomically(folder / "f.part", std::string_view("something else that came before"));
  CHECK(fetch_file(server.url() + "f", folder / "f", expected(), go_on));
  CHECK(range_of(server.requests().at(0)) == 31);
  CHECK(read_text(folder / "f") == kFile);
}

TEST_CASE("fetch_file keeps nothing that has another checksum or length", "[fetch]") {
  const TemporaryFolder folder;
  std::string served = kFile;
  LoopbackServer server([&](const std::string&) { return answer("200 OK", served); });
  const std::string url = server.url() + "f";
  served[77] = '!';
  CHECK_THROWS_WITH(fetch_file(url, folder / "f", expected(), go_on),
                    Contains(url + ": expected sha256 " + expected().sha256 + ", got "));
  CHECK(folder.entries() == 0);
  served = kFile + "x";
  CHECK_THROWS_WITH(fetch_file(url, folder / "f", expected(), go_on),
                    Contains(url + ": expected 100000 bytes, got more"));
  CHECK(folder.entries() == 0);
}

TEST_CASE("fetch_file names the address and the status, and keeps what was there", "[fetch]") {
  const TemporaryFolder folder;
  std::string status = "404 Not Found";
  LoopbackServer server([&](const std::string&) { return answer(status, "sorry"); });
  const std::string url = server.url() + "f";
  write_file_atomically(folder / "f", std::string_view("old"));
  CHECK_THROWS_WITH(fetch_file(url, folder / "f", expected(), go_on),
                    Contains(url + ": ") && Contains("404"));
  CHECK_THROWS_AS(fetch_file(url, folder / "f", expected(), go_on), IoError);
  CHECK(read_text(folder / "f") == "old");
  CHECK(folder.entries() == 1);
  // A partial file longer than the server's file is not resumed.
  status = "416 Range Not Satisfiable";
  write_file_atomically(folder / "f.part", std::string_view("part"));
  CHECK_THROWS_WITH(fetch_file(url, folder / "f", expected(), go_on), Contains("416"));
  CHECK(folder.entries() == 1);
  CHECK_THROWS_WITH(fetch_file("http://127.0.0.1:1/f", folder / "f", expected(), go_on),
                    Contains("http://127.0.0.1:1/f: expected 100000 bytes, got 0 (") && Contains("onnect"));
  CHECK(folder.entries() == 1);
}

TEST_CASE("fetch_file ends when it is asked to and keeps the part", "[fetch]") {
  const TemporaryFolder folder;
  LoopbackServer server(with_ranges);
  write_file_atomically(folder / "f.part", std::string_view(kFile).substr(0, 10));
  CHECK(!fetch_file(server.url() + "f", folder / "f", expected(), [](std::uintmax_t) { return false; }));
  CHECK(!fs::exists(folder / "f"));
  CHECK(fs::file_size(folder / "f.part") >= 10);
}

TEST_CASE("fetch_manifest brings what is missing or wrong, from encoded addresses", "[fetch]") {
  const TemporaryFolder folder;
  LoopbackServer server(with_ranges);
  Manifest m{.name = "n",
             .kind = "",
             .title = "",
             .licence = "",
             .citation = "",
             .url = "http://where",
             .files = {}};
  m.files = {expected("right"), expected("a b/\xC3\xA4#1.png"), expected("wrong")};
  CHECK_THROWS_WITH(
      fetch_manifest(m, folder.path, go_on),
      Contains(
          "n: no address of its files is known; give --base-url URL, or get it by hand from http://where"));
  m.base_url = server.url() + "set";
  write_file_atomically(folder / "right", std::string_view(kFile));
  write_file_atomically(folder / "wrong", std::string_view("x"));
  std::uintmax_t last = 0;
  const Fetched done =
      fetch_manifest(m, folder.path, [&](std::uintmax_t bytes) { return last = bytes, true; });
  CHECK((done.fetched == 2 && done.present == 1 && done.complete));
  CHECK(last == 300'000);
  CHECK(verify_manifest(m, folder.path, [](double) { return true; }).empty());
  REQUIRE(server.requests().size() == 2);
  CHECK(server.requests()[0].starts_with("GET /set/a%20b/%C3%A4%231.png HTTP/1.1\r\n"));
  const Fetched again = fetch_manifest(m, folder.path, go_on);
  CHECK((again.fetched == 0 && again.present == 3));
  CHECK(server.requests().size() == 2);
}

TEST_CASE("data fetch says where to get what has no address, and names a server's answer", "[fetch]") {
  const TemporaryFolder folder;
  const auto by_hand = run_command({"data", "fetch", "fox", folder.path.string()});
  CHECK(by_hand.code == cli::kFailed);
  CHECK_THAT(by_hand.err, Contains("get it by hand from https://github.com/NVlabs/instant-ngp") &&
                              Contains("fieldmark data verify fox"));
  LoopbackServer server([](const std::string&) { return answer("404 Not Found", ""); });
  const auto missing =
      run_command({"data", "fetch", "fox", folder.path.string(), "--base-url", server.url() + "fox"});
  CHECK(missing.code == cli::kFailed);
  CHECK_THAT(missing.err, Contains(server.url() + "fox/LICENSE.txt: ") && Contains("404"));
  const auto scheme = run_command({"data", "fetch", "fox", "x", "--base-url", "ftp://a/"});
  CHECK(scheme.code == cli::kUsage);
  CHECK_THAT(scheme.err, Contains("expected http:// or https://"));
}
