#include <fieldmark/core/error.h>
#include <fieldmark/engine/model_file.h>

#include "support/catch.h"
#include "support/temporary_folder.h"

using namespace fieldmark;

namespace {
SafetensorsFile with_entry(const std::string& text) {
  SafetensorsFile file;
  file.path = "m.safetensors";
  file.metadata["fieldmark"] = text;
  return file;
}
}  // namespace

TEST_CASE("model_file: what is set is read, through a file") {
  const TemporaryFolder folder;
  SafetensorsFile file;
  set_model_info(file, {.kind = "owner", .config = R"({"bits": 48, "name": "a \"b\"", "box": [0.1, 1]})"});
  CHECK(file.metadata["fieldmark"] ==
        R"({"config":{"bits":48,"box":[0.1,1],"name":"a \"b\""},"format":1,"kind":"owner"})");
  file.write(folder / "o.safetensors");
  const ModelInfo info = require_kind(SafetensorsFile::read(folder / "o.safetensors"), "owner");
  CHECK(info.kind == "owner");
  CHECK(info.config == R"({"bits":48,"box":[0.1,1],"name":"a \"b\""})");
}

TEST_CASE("model_file: equal objects give equal text, no config gives none") {
  SafetensorsFile a, b, none;
  set_model_info(a, {.kind = "field", .config = R"({"x":1,"a":{"c":2,"b":3}})"});
  set_model_info(b, {.kind = "field", .config = R"( { "a" : {"b":3, "c":2}, "x":1 } )"});
  CHECK(a.metadata == b.metadata);
  set_model_info(none, {.kind = "key"});
  CHECK(none.metadata["fieldmark"] == R"({"format":1,"kind":"key"})");
  CHECK(model_info(none).config == "{}");
}

TEST_CASE("model_file: another kind, or no Fieldmark file at all, is named with the path") {
  const auto field = with_entry(R"({"format":1,"kind":"field"})");
  CHECK_THROWS_AS(require_kind(field, "owner"), IoError);
  CHECK_THROWS_WITH(require_kind(field, "owner"),
                    "m.safetensors: expected an OWNER file (kind 'owner'), found kind 'field'");
  CHECK_THROWS_WITH(require_kind(with_entry(R"({"format":1,"kind":"owner"})"), "key"),
                    "m.safetensors: expected a KEY file (kind 'key'), found kind 'owner'");
  SafetensorsFile other;
  other.path = "vgg.safetensors";
  CHECK_THROWS_WITH(
      model_info(other),
      "vgg.safetensors: not a Fieldmark file: expected the metadata entry 'fieldmark', found none");
  other.metadata = {{"format", "pt"}, {"author", "x"}};
  CHECK_THROWS_WITH(require_kind(other, "field"),
                    Contains("not a Fieldmark file") && Contains("found author, format"));
}

TEST_CASE("model_file: a malformed entry is refused with what was expected") {
  const std::string head = "m.safetensors: metadata entry 'fieldmark': ";
  CHECK_THROWS_WITH(model_info(with_entry("{")), head + "expected a JSON object, found '{'");
  CHECK_THROWS_WITH(model_info(with_entry("[1]")), head + "expected a JSON object, found '[1]'");
  CHECK_THROWS_WITH(model_info(with_entry(R"({"format":2,"sort":"field"})")),
                    head + "expected format 1, found 2");
  CHECK_THROWS_WITH(model_info(with_entry("{}")), head + "expected format 1, found nothing");
  CHECK_THROWS_WITH(model_info(with_entry(R"({"format":1})")),
                    head + "expected a kind (a string), found nothing");
  CHECK_THROWS_WITH(model_info(with_entry(R"({"format":1,"kind":7})")),
                    head + "expected a kind (a string), found 7");
  CHECK_THROWS_WITH(model_info(with_entry(R"({"format":1,"kind":"key","config":[]})")),
                    head + "expected config to be an object, found []");
}

TEST_CASE("model_file: a bad kind or config is never written") {
  SafetensorsFile file;
  CHECK_THROWS_AS(set_model_info(file, {.kind = ""}), ValueError);
  CHECK_THROWS_WITH(set_model_info(file, {.kind = ""}), "[set_model_info] kind must not be empty, got ''");
  CHECK_THROWS_WITH(set_model_info(file, {.kind = "key", .config = "[1]"}),
                    "[set_model_info] config must be a JSON object, got '[1]'");
  CHECK_THROWS_WITH(set_model_info(file, {.kind = "key", .config = ""}),
                    "[set_model_info] config must be a JSON object, got ''");
  CHECK(file.metadata.empty());
}
