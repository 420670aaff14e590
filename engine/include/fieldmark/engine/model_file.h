#pragma once
#include <fieldmark/engine/safetensors.h>

#include <string>
#include <string_view>

namespace fieldmark {

/// The metadata entry `fieldmark` of a file: JSON {"format": 1, "kind": KIND, "config": {...}}. It holds no
/// times, host names or paths, so that equal runs give equal bytes.
struct ModelInfo {
  std::string kind;           ///< "field", "owner", "key", ...
  std::string config = "{}";  ///< a JSON object
};

/// Sets the entry and omits an empty config. Equal objects give equal text, whatever the order of their keys.
/// @throws ValueError if the kind is empty or the config is not a JSON object
void set_model_info(SafetensorsFile& file, const ModelInfo& info);

/// Reads the entry.
/// @throws IoError if there is none ("not a Fieldmark file"), it is malformed, or its format is not 1
ModelInfo model_info(const SafetensorsFile& file);

/// Reads the entry of a file and requires its kind.
/// @throws IoError as model_info, or "PATH: expected an OWNER file (kind 'owner'), found kind 'field'"
ModelInfo require_kind(const SafetensorsFile& file, std::string_view kind);

}  // namespace fieldmark
