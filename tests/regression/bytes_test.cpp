#include <fieldmark/core/digest.h>
#include <fieldmark/core/files.h>
#include <fieldmark/engine/isa.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>

#include "regression/recorded_bytes.h"
#include "support/catch.h"
#include "support/temporary_folder.h"
#include "tools/tiny_scene.h"
#include "watermark/test_key.h"

// Every file that the command writes for a fixed seed, key and number of steps has recorded bytes, for one
// thread and for two. A change that is meant to change results says so and records them anew from the test's
// own output.
using namespace fieldmark;

namespace {

using Hashes = std::map<std::string, std::string>;

void run(std::vector<std::string> words, const std::string& threads) {
  words.insert(words.end(), {"--threads", threads, "--seed", "7"});
  const Outcome outcome = run_command(words);
  INFO(outcome.err);
  REQUIRE(outcome.code == 0);
}

// Returns a hash of all files in a folder, in order of names.
std::string folder_hash(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> paths;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) paths.push_back(entry.path());
  std::sort(paths.begin(), paths.end());
  std::string lines;
  for (const auto& path : paths) lines += path.filename().string() + " " + sha256_file_hex(path) + "\n";
  return sha256_hex(lines);
}

// Returns a hash of the logits of every bit in every view: the detector's reading, digit for digit; of
// presets paper and code these are signs.
std::string logits_hash(const std::string& json_file) {
  const auto json = nlohmann::json::parse(read_text(json_file));
  std::string numbers;
  for (const auto& view : json.at("views")) numbers += view.at("logits").dump() + "\n";
  return sha256_hex(numbers);
}

// Adds the hashes of all that one preset of `embed` writes, marks and reads.
void add_mark(Hashes& hashes, const TemporaryFolder& folder, const std::string& preset,
              const std::string& threads) {
  const std::string owner = folder / (preset + "_owner.fm"), baked = folder / (preset + "_baked.fm"),
                    views = folder / (preset + "_views"), read = folder / (preset + "_read.json");
  std::vector<std::string> embed{"embed",
                                 "--field",
                                 folder / "field.fm",
                                 "--out",
                                 owner,
                                 "--key",
                                 folder / "key",
                                 "--bits",
                                 "8",
                                 "--preset",
                                 preset,
                                 "--reader-size",
                                 "32",
                                 "--steps",
                                 "6",
                                 "--views",
                                 "8",
                                 "--measured-views",
                                 "1"};
  if (preset == "fast") embed.insert(embed.end(), {"--cells", "6", "--directions", "novel"});
  run(embed, threads);
  hashes[preset + " owner"] = sha256_file_hex(owner);
  run({"bake", "--owner", owner, "--message", "a6", "--out", baked, "--steps", "4"}, threads);
  hashes[preset + " baked field"] = sha256_file_hex(baked);
  run({"render", "--field", baked, "--out", views, "--count", "1", "--size", "32"}, threads);
  hashes[preset + " renders"] = folder_hash(views);
  run({"extract", "--owner", owner, views, "--fpr", "1", "--json", read}, threads);
  hashes[preset + " logits"] = logits_hash(read);
}

Hashes written(const std::string& threads) {
  const TemporaryFolder folder;
  Hashes hashes;
  run({"scene", "--out", folder / "scene", "--kind", "sphere", "--size", "16", "--views", "12"}, threads);
  hashes["scene"] = folder_hash(std::filesystem::path(folder / "scene") / "train");
  run({"train", "--data", folder / "scene", "--out", folder / "hash.fm", "--steps", "60", "--max-megabytes",
       "1"},
      threads);
  hashes["hash field"] = sha256_file_hex(folder / "hash.fm");
  run({"train", "--data", folder / "scene", "--out", folder / "mlp.fm", "--preset", "mlp", "--steps", "4"},
      threads);
  hashes["mlp field"] = sha256_file_hex(folder / "mlp.fm");
  run({"render", "--field", folder / "hash.fm", "--out", folder / "views", "--count", "1", "--size", "32"},
      threads);
  hashes["hash renders"] = folder_hash(folder / "views");
  // `train` makes larger fields: to render the many views that marks learn from would take most of the test.
  tiny_field(folder, folder / "scene");
  hashes["marked field"] = sha256_file_hex(folder / "field.fm");
  watermark::save_key(folder / "key", test_key(5));
  for (const char* preset : {"fast", "paper", "code"}) add_mark(hashes, folder, preset, threads);
  return hashes;
}

void check_bytes(Isa level, const Hashes& expected, const std::string& threads) {
  if (isa_supported() < level) {
    std::cout << "SKIPPED: recorded bytes needs a CPU with another instruction set\n";
    return;
  }
  const ScopedIsa scope(level);
  const Hashes got = written(threads);
  for (const auto& [name, hash] : got) {
    INFO("{\"" << name << "\", \"" << hash << "\"},");
    const auto found = expected.find(name);
    CHECK((found != expected.end() && found->second == hash));
  }
  CHECK(got.size() == expected.size());
}

}  // namespace

// Separate cases run in parallel.
TEST_CASE("bytes: all files are as recorded on x86-64-v2, one thread") {
  check_bytes(Isa::v2, kBytesV2, "1");
}
TEST_CASE("bytes: all files are as recorded on AVX2, two threads") { check_bytes(Isa::v3, kBytesV3, "2"); }
