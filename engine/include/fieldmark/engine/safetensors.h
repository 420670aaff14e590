#pragma once
#include <fieldmark/core/files.h>
#include <fieldmark/engine/tensor.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace fieldmark {

/// A safetensors file of named arrays and string metadata: the format of all model, checkpoint and weight
/// files.
/// Source: huggingface/safetensors, format description: 8 bytes of header length N (little endian), N bytes
/// of JSON from '{', then the arrays without gaps. Here arrays have rank 5 at most.
struct SafetensorsFile {
  /// One array of a file.
  struct Entry {
    std::string name;             ///< unique in the file
    std::string dtype;            ///< "F32", "U8", ... as the file spells it
    Shape shape;                  ///< at most rank 5
    std::vector<std::byte> data;  ///< row-major, little endian
  };
  std::map<std::string, std::string> metadata;  ///< strings by key, both UTF-8
  std::vector<Entry> tensors;                   ///< in the order of the file, or as added
  std::string path;                             ///< for error texts

  /// Reads and checks a whole file.
  /// @throws IoError if it cannot be read or is not valid
  static SafetensorsFile read(const std::filesystem::path& path);
  /// Like read(), but from memory. @param name  stands for the path in error texts
  static SafetensorsFile parse(std::span<const std::byte> bytes, std::string_view name);
  /// Writes atomically (see AtomicFile). Equal contents give equal bytes: header keys are sorted; arrays
  /// follow in the order added, wider elements first, so that each is aligned.
  /// @param access  secret for a file that holds a key
  /// @throws IoError if writing fails   @throws ValueError if a name or metadata is not UTF-8
  void write(const std::filesystem::path& to, Access access = Access::shared) const;

  /// @{
  /// Appends an array. @throws ValueError if the name is taken or "__metadata__"
  /// @throws ShapeError unless data has shape.size() elements
  void add(std::string_view name, Shape shape, std::span<const float> data);
  void add(std::string_view name, Shape shape, std::span<const double> data);
  void add(std::string_view name, Shape shape, std::span<const std::uint8_t> data);
  void add(std::string_view name, Shape shape, std::span<const std::int32_t> data);
  void add(std::string_view name, Shape shape, std::span<const std::int64_t> data);
  void add(std::string_view name, Shape shape, std::span<const std::uint64_t> data);
  /// @}

  /// True if there is an array of this name.
  bool has(std::string_view name) const;
  /// Returns an array. @throws IoError if there is no such array; the text lists the arrays of the file
  const Entry& at(std::string_view name) const;
  /// Returns an F32 array, or an F16 or BF16 array widened exactly.
  /// @throws IoError if the array is missing or of another dtype, as do the functions below
  Tensor<float> f32(std::string_view name) const;
  /// Returns an F64 array.
  Tensor<double> f64(std::string_view name) const;
  /// @{
  /// Returns the elements of an array, row-major.
  std::vector<std::uint8_t> u8(std::string_view name) const;
  std::vector<std::int32_t> i32(std::string_view name) const;
  std::vector<std::int64_t> i64(std::string_view name) const;
  std::vector<std::uint64_t> u64(std::string_view name) const;
  /// @}
};

}  // namespace fieldmark
