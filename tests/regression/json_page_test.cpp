#include <fieldmark/core/files.h>

#include <map>
#include <set>
#include <sstream>

#include "support/source_dir.h"
#include "tools/tiny_job.h"

using namespace fieldmark;

// docs/json.md lists the keys of every result: all that a command writes, and none that it never does.
namespace {

struct Keys {
  std::set<std::string> always, sometimes;
};

// Returns the keys of each section of the page. Keys whose meaning begins with a condition come sometimes.
std::map<std::string, Keys> documented() {
  std::map<std::string, Keys> sections;
  std::istringstream page(read_text(std::filesystem::path(source_dir()) / "docs/json.md"));
  std::string section;
  for (std::string line; std::getline(page, line);) {
    if (line.starts_with("## ")) section = line.substr(3);
    if (!line.starts_with("| `")) continue;
    const std::size_t middle = line.find(" | ");
    const std::string names = line.substr(0, middle), meaning = line.substr(middle + 3);
    const bool condition = meaning.starts_with("with `") || meaning.starts_with("if ") ||
                           meaning.starts_with("unless ") || meaning.starts_with("with several ");
    for (std::size_t at = 0; (at = names.find('`', at)) != std::string::npos;) {
      const std::size_t end = names.find('`', at + 1);
      (condition ? sections[section].sometimes : sections[section].always)
          .insert(names.substr(at + 1, end - at - 1));
      at = end + 1;
    }
  }
  return sections;
}

// Compares the keys of a result with a section of the page.
void compare_keys(const nlohmann::json& result, const Keys& keys) {
  std::set<std::string> left = keys.always;
  for (const auto& [key, value] : result.items()) {
    if (key == "notes" || key == "left_out" || keys.sometimes.contains(key)) continue;
    CAPTURE(key);
    CHECK(left.erase(key) == 1);
  }
  CHECK(left == std::set<std::string>{});
}

void compare(std::vector<std::string> words, const Keys& keys) {
  CAPTURE(words[0]);
  words.insert(words.end(), {"--json", "-"});
  const auto r = run_command(words);
  INFO(r.err);
  REQUIRE(r.code == 0);
  compare_keys(nlohmann::json::parse(r.out), keys);
}

}  // namespace

TEST_CASE("json page: the keys of every result are those of docs/json.md") {
  const TinyJob& job = TinyJob::get();
  const TemporaryFolder folder;
  auto pages = documented();
  CHECK(pages.size() == 12);
  const std::string views = job.images(), baked = folder / "baked.fm", evidence = folder / "evidence";
  const auto with_owner = [&](const std::string& command, std::vector<std::string> more) {
    more.insert(more.begin(), {command, "--owner", job.owner});
    return more;
  };
  compare({"train", "--data", job.scene, "--out", folder / "f.fm", "--steps", "2"}, pages["train"]);
  compare({"eval", "--field", job.field, "--data", job.scene}, pages["eval"]);
  compare(with_owner("bake", {"--message", "5", "--out", baked, "--steps", "2"}), pages["bake"]);
  compare(with_owner("measure", {"--count", "2", "--informed-count", "0"}), pages["measure"]);
  compare(with_owner("measure", {"--field", baked, "--message", "5", "--count", "2", "--informed-count", "0",
                                 "--data", job.scene, "--cameras", "novel,ring"}),
          pages["measure"]);
  Keys embed = pages["measure"];
  embed.always.erase("payload");  // of random messages there is none
  embed.always.merge(pages["embed"].always);
  compare_keys(job.embedded, embed);
  compare(with_owner("extract", {"--fpr", "1", views}), pages["extract"]);
  compare(with_owner("verify",
                     {"--message", "5", "--fpr", "1", "--wrong-keys", "9", "--evidence", evidence, views}),
          pages["verify"]);
  write_file_atomically(folder / "names", std::string("Anna\n"));
  compare(with_owner("trace", {"--message", "5", "--fpr", "1", "--copies", folder / "names", views}),
          pages["trace"]);
  compare(with_owner("null", {"--keys", "3", views}), pages["null"]);
  compare({"render", "--field", job.field, "--out", folder / "r", "--count", "1", "--size", "8", "--depth"},
          pages["render"]);
  compare({"check", evidence, views}, pages["check"]);
  compare({"info", job.owner}, pages["info"]);
}
