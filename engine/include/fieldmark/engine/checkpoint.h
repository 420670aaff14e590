#pragma once
#include <fieldmark/engine/safetensors.h>

namespace fieldmark {

/// The file of a run that can be resumed, without arrays yet.
/// @param run  all that the run depends on, in words
SafetensorsFile new_checkpoint(std::string run);

/// Reads what new_checkpoint() began. @throws IoError if the file is of no run or of another one, both named
SafetensorsFile read_checkpoint(const std::filesystem::path& path, std::string_view run);

/// Puts the numbers of an F32 array where they were. @throws IoError if there is none, or of another size
void restore_numbers(const SafetensorsFile& file, std::string_view name, std::span<float> to);

}  // namespace fieldmark
