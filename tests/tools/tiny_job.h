#pragma once
#include <fieldmark/core/files.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "support/kept_folder.h"
#include "tools/test_key_file.h"
#include "tools/tiny_scene.h"

/// Runs `embed` for two steps, too few to read anything: 4 bits, 6 cells per axis for preset fast, and a
/// fixed key, so that the owner is the same in every run.
/// @param more  further options; they replace those above
inline Outcome tiny_embed(const std::string& field, const std::string& owner,
                          const std::vector<std::string>& more) {
  const auto given = [&](const char* name) { return std::ranges::find(more, name) != more.end(); };
  const TemporaryFolder folder;
  std::vector<std::string> words{"embed", "--field", field, "--out", owner};
  const std::string usual[][2] = {{"--bits", "4"},  {"--cells", "6"}, {"--reader-size", "32"},
                                  {"--steps", "2"}, {"--views", "8"}, {"--key", test_key_file(folder)}};
  for (const auto& [name, value] : usual)
    if (!given(name.c_str()) && !(name == "--cells" && given("--preset")))
      words.insert(words.end(), {name, value});
  words.insert(words.end(), more.begin(), more.end());
  return run_command(words);
}

/// A field and an owner of 4-bit messages, made once. They are trained too briefly to read anything, but
/// exercise every path.
struct TinyJob {
  TemporaryFolder folder;
  std::string scene = folder / "scene", field = folder / "field.fm", owner = folder / "owner.fm";
  nlohmann::json embedded;

  static const TinyJob& get() {
    static const TinyJob job;
    return job;
  }
  /// Writes two images of the field into a folder.
  std::string images() const {
    const std::string out = folder / "views";
    if (std::filesystem::exists(out)) return out;
    const auto r = run_command({"render", "--field", field, "--out", out, "--count", "2", "--size", "32"});
    INFO(r.err);
    REQUIRE(r.code == 0);
    return out;
  }

 private:
  TinyJob() {
    kept_files("tiny_job", folder.path, [this] { make(); });
    embedded = nlohmann::json::parse(fieldmark::read_text(folder / "embedded.json"));
    std::filesystem::remove(folder / "embedded.json");
  }
  void make() const {
    tiny_field(folder, tiny_scene(folder));
    const auto r = tiny_embed(
        field, owner, {"--measured-views", "2", "--distort", "blur_1", "--json", folder / "embedded.json"});
    INFO(r.err);
    REQUIRE(r.code == 0);
  }
};
