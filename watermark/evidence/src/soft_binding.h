#pragma once
#include <fieldmark/watermark/payload/message.h>

#include <string>
#include <string_view>

namespace fieldmark::watermark {

/// The algorithm's name in soft bindings: written like those of the C2PA soft binding algorithm list, a
/// domain from its end, a name and a version. It is not on that list: who deploys it registers a name of
/// their own.
inline constexpr std::string_view kSoftBindingAlgorithm = "org.fieldmark.keyed-cells.1";

/// A C2PA soft-binding assertion as JSON, to stand among the assertions of a manifest's definition: it says
/// that the images carry a message, by which a repository finds the manifest after it was stripped.
///   {"label": "c2pa.soft-binding", "data": {"alg", "name", "blocks": [{"scope": {}, "value"}], "alg-params",
///   "bindingMetadata": {"description"}}}
/// value is the message as base64 of its bits, most significant bit first, filled up with zeros; alg-params
/// is base64 of {"bits": N, "commitment": CLAIM}; the empty scope means the whole image. Source: C2PA
/// Technical Specification 2.x, section "Soft Binding". Neither key nor owner are in it.
/// @param commitment  commitment()   @return canonical_json()
std::string soft_binding_json(const Message& message, std::string_view commitment);

}  // namespace fieldmark::watermark
