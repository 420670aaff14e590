#pragma once
#include <fieldmark/engine/safetensors.h>

#include <charconv>
#include <concepts>
#include <map>
#include <ranges>

namespace fieldmark {

/// Everything that determines the result of a training run: its options by name and the SHA-256 of each
/// input. A checkpoint carries the fingerprint of its run, so that no other run resumes from it.
class RunFingerprint {
 public:
  /// @{
  /// Records the value of an option.
  template <class T>
  requires std::is_arithmetic_v<T>
  void option(std::string_view name, T value) {
    if constexpr (std::same_as<T, bool>) {
      add(name, value ? "true" : "false");
    } else {
      char text[32];
      add(name, {text, std::to_chars(text, text + sizeof text, value).ptr});
    }
  }
  void option(std::string_view name, std::string_view text);
  /// @}
  /// Records every option of a JSON object, including those of nested objects, under the names "NAME/KEY".
  /// @throws ValueError if the text is not a JSON object
  void options(std::string_view name, std::string_view json);

  /// Records the SHA-256 of the elements of an input.
  template <std::ranges::contiguous_range R>
  requires std::is_arithmetic_v<std::ranges::range_value_t<R>>
  void input(std::string_view name, const R& elements) {
    hash_input(name, std::as_bytes(std::span(elements)));
  }
  /// Records an input whose SHA-256 is known.
  void input_digest(std::string_view name, std::string sha256) {
    inputs_[std::string(name)] = std::move(sha256);
  }

  /// Writes options and inputs to the metadata of a checkpoint, as canonical JSON.
  void write(SafetensorsFile& file) const;
  /// Requires that the fingerprint of a checkpoint equals this one.
  /// @throws IoError if the file is not a checkpoint, or names the first option or input that differs: "PATH:
  /// this checkpoint was made with option 'NAME' 24576, this run has 12288"
  void require(const SafetensorsFile& file) const;
  /// Returns the options that a checkpoint holds under a name, as the JSON object given to options().
  /// @throws IoError if the file is not a checkpoint or has none
  static std::string options_of(const SafetensorsFile& file, std::string_view name);

 private:
  using Texts = std::map<std::string, std::string>;
  void add(std::string_view name, std::string_view json);
  void hash_input(std::string_view name, std::span<const std::byte> bytes);
  Texts options_, inputs_;  // by name: JSON, digests
};

}  // namespace fieldmark
