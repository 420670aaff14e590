#pragma once
#include <nlohmann/json.hpp>
#include <string>

#include "tools/tiny_scene.h"

/// A field and an owner of 4-bit messages, made once for all tests of a program by the commands themselves:
/// too little training to read anything, enough to run every path.
struct TinyJob {
  TemporaryFolder folder;
  std::string scene = tiny_scene(folder), field = tiny_field(folder, scene, "100"),
              owner = folder / "owner.fm";
  nlohmann::json embedded;

  static const TinyJob& get() {
    static const TinyJob job;
    return job;
  }
  /// Two pictures of the field, in a folder.
  std::string pictures() const {
    const std::string out = folder / "views";
    const auto r = run_command({"render", "--field", field, "--out", out, "--count", "2", "--size", "32"});
    INFO(r.err);
    REQUIRE(r.code == 0);
    return out;
  }

 private:
  TinyJob() {
    const auto r =
        run_command({"embed", "--field",       field,    "--out",   owner, "--bits",  "4", "--cells",
                     "6",     "--reader-size", "32",     "--steps", "2",   "--views", "8", "--measured-views",
                     "2",     "--under",       "blur_1", "--json",  "-"});
    INFO(r.err);
    REQUIRE(r.code == 0);
    embedded = nlohmann::json::parse(r.out);
  }
};
