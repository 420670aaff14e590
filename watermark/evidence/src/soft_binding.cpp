#include "soft_binding.h"
#include <fieldmark/core/base64.h>
#include "canonical_json.h"

#include <nlohmann/json.hpp>

namespace fieldmark::watermark {
namespace {

using Json = nlohmann::json;

std::string base64_of(const std::string& text) { return to_base64(std::as_bytes(std::span(text))); }

std::string packed_bits(const Message& message) {
  std::string bytes((message.bits.size() + 7) / 8, '\0');
  for (std::size_t i = 0; i < message.bits.size(); ++i)
    if (message.bits[i]) bytes[i / 8] = static_cast<char>(bytes[i / 8] | (0x80 >> (i % 8)));
  return bytes;
}

}  // namespace

std::string soft_binding_json(const Message& message, std::string_view commitment) {
  const Json parameters{{"bits", message.size()}, {"claim", commitment}};  // the JSON key of version 0.1
  const Json block{{"scope", Json::object()}, {"value", base64_of(packed_bits(message))}};
  const Json data{
      {"alg", kSoftBindingAlgorithm},
      {"name", "Message in the colours of a radiance field, read from its rendered pictures"},
      {"blocks", Json::array({block})},
      {"alg-params", base64_of(parameters.dump())},
      {"bindingMetadata",
       {{"description",
         "Keyed invisible watermark of Fieldmark. The name under alg is not registered with the C2PA soft "
         "binding algorithm list; who deploys it puts a registered name of their own there."}}}};
  return canonical_json(Json{{"label", "c2pa.soft-binding"}, {"data", data}}.dump(), "soft binding");
}

}  // namespace fieldmark::watermark
