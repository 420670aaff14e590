#include <fieldmark/core/error.h>
#include <fieldmark/engine/checkpoint.h>

#include <algorithm>

namespace fieldmark {

SafetensorsFile new_checkpoint(std::string run) {
  SafetensorsFile file;
  file.metadata["fieldmark"] = R"({"format":1,"kind":"checkpoint"})";
  file.metadata["of"] = std::move(run);
  return file;
}

SafetensorsFile read_checkpoint(const std::filesystem::path& path, std::string_view run) {
  SafetensorsFile file = SafetensorsFile::read(path);
  const auto of = file.metadata.find("of");
  if (of == file.metadata.end() || of->second != run)
    throw IoError(path.string() + ": expected a checkpoint of this run (" + std::string(run) + "), found " +
                  (of == file.metadata.end() ? std::string("another kind of file") : of->second));
  return file;
}

void restore_numbers(const SafetensorsFile& file, std::string_view name, std::span<float> to) {
  const Tensor<float> t = file.f32(name);
  if (t.data.size() != to.size())
    throw IoError(file.path + ": tensor '" + std::string(name) + "': expected " + std::to_string(to.size()) +
                  " numbers, found " + std::to_string(t.data.size()));
  std::copy(t.data.begin(), t.data.end(), to.begin());
}

}  // namespace fieldmark
