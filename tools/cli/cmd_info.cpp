#include <fieldmark/core/digest.h>
#include <fieldmark/engine/safetensors.h>
#include <fieldmark/watermark/mark/owner.h>

#include <cstdio>
#include <filesystem>
#include <memory>
#include <ostream>

#include "cli/cli.h"
#include "cli/commands.h"
#include "cli/context.h"
#include "cli/fingerprints.h"

namespace fieldmark::cli {
namespace {

struct InfoArguments {
  std::string file;
};

// Fieldmark's own entry is JSON; entries of other programs are shown as text.
Json metadata_json(const SafetensorsFile& file) {
  Json json = Json::object();
  for (const auto& [key, value] : file.metadata) {
    Json parsed = Json::parse(value, nullptr, false);
    json[key] = parsed.is_discarded() ? Json(value) : std::move(parsed);
  }
  return json;
}

bool is_owner_file(const Json& metadata) {
  const auto entry = metadata.find("fieldmark");
  return entry != metadata.end() && entry->is_object() && entry->contains("kind") &&
         entry->at("kind") == "owner";
}

int run_info(const InfoArguments& options, Context& context) {
  const auto file = SafetensorsFile::read(options.file);
  const std::string sha256 = sha256_file_hex(options.file);
  const Json metadata = metadata_json(file);
  Json tensors = Json::array();
  Index numbers = 0;
  auto& text = context.text();
  text << options.file << "\nsha256 " << sha256 << "\n";
  Json networks = nullptr;
  if (is_owner_file(metadata)) {
    networks = networks_sha256(file);
    text << "networks sha256 " << networks.get<std::string>() << ", of all tensors but the key\n";
  }
  for (const auto& [key, value] : metadata.items()) text << key << ": " << value.dump(2) << "\n";
  for (const auto& tensor : file.tensors) {
    char line[200];
    std::snprintf(line, sizeof line, "%-40s %-5s %-24s %10zu bytes\n", tensor.name.c_str(),
                  tensor.dtype.c_str(), tensor.shape.str().c_str(), tensor.data.size());
    text << line;
    Json shape = Json::array();
    for (int axis = 0; axis < tensor.shape.rank(); ++axis) shape.push_back(tensor.shape[axis]);
    tensors.push_back(
        {{"name", tensor.name}, {"dtype", tensor.dtype}, {"shape", shape}, {"bytes", tensor.data.size()}});
    numbers += tensor.shape.size();
  }
  const auto bytes = std::filesystem::file_size(options.file);
  text << file.tensors.size() << " tensors, " << numbers << " elements, " << bytes << " bytes\n";
  context.result({{"file_bytes", bytes},
                  {"sha256", sha256},
                  {"networks_sha256", networks},
                  {"numbers", numbers},
                  {"metadata", metadata},
                  {"tensors", tensors}});
  return kOk;
}

}  // namespace

Command add_info(CommandLine& app) {
  auto options = std::make_shared<InfoArguments>();
  app.add_option("file", options->file, "File to describe: a field, owner, key or any other safetensors file")
      ->required()
      ->type_name("FILE");
  return [options](Context& context) { return run_info(*options, context); };
}

}  // namespace fieldmark::cli
