#include <fieldmark/core/error.h>
#include <fieldmark/core/files.h>
#include <fieldmark/engine/run_fingerprint.h>

#include <limits>

#include "support/catch.h"

using namespace fieldmark;

namespace {

RunFingerprint fingerprint() {
  RunFingerprint f;
  f.option("samples_per_step", 24576);
  f.option("stop", 1e-2f);
  f.option("lr", 2e-2);
  f.option("carve", true);
  f.option("kind", "hash \"table\"");
  f.options("field", R"({"levels": 4, "space": {"kind": "cube", "sides": [1, 2.5]}, "names": []})");
  f.input("image 3", std::vector<float>{1, 2, 3});
  return f;
}

SafetensorsFile written(const RunFingerprint& f) {
  SafetensorsFile file;
  file.path = "run.checkpoint";
  f.write(file);
  return file;
}

}  // namespace

TEST_CASE("run_fingerprint: accepts the checkpoint of an equal run") {
  const SafetensorsFile file = written(fingerprint());
  CHECK_NOTHROW(fingerprint().require(file));
  CHECK(
      file.metadata.at("options") ==
      R"({"carve":true,"field/levels":4,"field/names":[],"field/space/kind":"cube",)"
      R"("field/space/sides":[1,2.5],"kind":"hash \"table\"","lr":0.02,"samples_per_step":24576,"stop":0.01})");
  CHECK(RunFingerprint::options_of(file, "field") ==
        R"({"levels":4,"names":[],"space":{"kind":"cube","sides":[1,2.5]}})");
}

TEST_CASE("run_fingerprint: names the option or input that differs") {
  const SafetensorsFile file = written(fingerprint());
  RunFingerprint other = fingerprint();
  other.option("samples_per_step", 12288);
  CHECK_THROWS_WITH(
      other.require(file),
      "run.checkpoint: this checkpoint was made with option 'samples_per_step' 24576, this run has "
      "12288");
  other = fingerprint();
  other.options("field", R"({"space": {"sides": [1, 3]}})");
  CHECK_THROWS_WITH(other.require(file), Contains("option 'field/space/sides' [1,2.5], this run has [1,3]"));
  other = fingerprint();
  other.option("more", std::numeric_limits<double>::quiet_NaN());
  CHECK_THROWS_WITH(other.require(file), Contains("option 'more' none, this run has \"nan\""));
  other = fingerprint();
  other.option("kind", std::string(100, 'x'));
  CHECK_THROWS_WITH(other.require(file), Contains("this run has \"" + std::string(56, 'x') + "..."));
  other = fingerprint();
  other.input("image 3", std::vector<float>{1, 2, 4});
  CHECK_THROWS_WITH(other.require(file),
                    "run.checkpoint: this checkpoint was made of another input 'image 3'");
  other = fingerprint();
  other.input("image 4", std::vector<float>{});
  CHECK_THROWS_WITH(other.require(file), Contains("of another input 'image 4'"));
}

TEST_CASE("run_fingerprint: refuses files that are not checkpoints, and options that are not objects") {
  SafetensorsFile file;
  file.path = "x";
  CHECK_THROWS_WITH(fingerprint().require(file), Contains("x: not a Fieldmark file"));
  file.metadata["fieldmark"] = R"({"format":1,"kind":"field"})";
  CHECK_THROWS_WITH(fingerprint().require(file), Contains("expected a CHECKPOINT file"));
  file.metadata["fieldmark"] = R"({"format":1,"kind":"checkpoint"})";
  CHECK_THROWS_WITH(fingerprint().require(file),
                    Contains("metadata entry 'options'") && Contains("earlier version"));
  CHECK_THROWS_WITH(RunFingerprint::options_of(written(fingerprint()), "owner"),
                    "run.checkpoint: expected a checkpoint with options 'owner/...', found none");
  RunFingerprint f;
  CHECK_THROWS_AS(f.options("field", "[1]"), ValueError);
  CHECK_THROWS_AS(f.options("field", "{"), ValueError);
}
