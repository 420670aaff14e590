#include <fieldmark/core/error.h>
#include <fieldmark/core/files.h>
#include <fieldmark/engine/safetensors.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>

namespace fieldmark {
namespace {

using nlohmann::json;
static_assert(std::endian::native == std::endian::little, "arrays are copied as they lie in memory");

constexpr std::size_t kLengthBytes = 8;
// The limit of the reference reader: a wrong length must not allocate all memory of the machine.
constexpr std::uint64_t kMaxHeader = 100'000'000;
constexpr char kMetadata[] = "__metadata__";

constexpr std::pair<std::string_view, std::uint64_t> kDtypes[] = {
    {"BOOL", 1}, {"U8", 1},  {"I8", 1},  {"F8_E5M2", 1}, {"F8_E4M3", 1}, {"U16", 2}, {"I16", 2}, {"F16", 2},
    {"BF16", 2}, {"U32", 4}, {"I32", 4}, {"F32", 4},     {"U64", 8},     {"I64", 8}, {"F64", 8}};

/// Returns the bytes of one element, or 0 for an unknown dtype.
std::uint64_t element_bytes(std::string_view dtype) {
  for (const auto& [name, bytes] : kDtypes)
    if (name == dtype) return bytes;
  return 0;
}

struct Reader {
  std::string path;
  std::uint64_t header = 0, data = 0;  // bytes of each

  [[noreturn]] void fail(const std::string& what) const {
    throw IoError("[safetensors] " + path + ": " + what);
  }
  [[noreturn]] void fail(const std::string& tensor, const std::string& what) const {
    fail("tensor \"" + tensor + "\": " + what);
  }

  std::string_view header_text(std::span<const std::byte> bytes) {
    if (bytes.size() < kLengthBytes)
      fail("byte 0: expected 8 bytes of header length, found a file of " + std::to_string(bytes.size()));
    std::memcpy(&header, bytes.data(), kLengthBytes);
    const std::uint64_t rest = bytes.size() - kLengthBytes;
    if (header > rest || header > kMaxHeader)
      fail("byte 0: expected a header length of at most " + std::to_string(std::min(rest, kMaxHeader)) +
           " (the file has " + std::to_string(bytes.size()) + " bytes), found " + std::to_string(header));
    data = rest - header;
    return {reinterpret_cast<const char*>(bytes.data()) + kLengthBytes, static_cast<std::size_t>(header)};
  }

  json parse_header(std::string_view text) const {
    if (text.empty() || text.front() != '{') fail("byte 8: expected '{', the start of the JSON header");
    std::set<std::string> names;
    // The parser silently keeps one of two equal keys.
    const auto no_twins = [&](int depth, json::parse_event_t event, json& value) {
      if (event == json::parse_event_t::key && depth == 1 && !names.insert(value.get<std::string>()).second)
        fail(value.get<std::string>(), "expected once in the header, found twice");
      return true;
    };
    try {
      return json::parse(text, no_twins);
    } catch (const json::exception& e) {
      std::string where;
      if (const auto* p = dynamic_cast<const json::parse_error*>(&e))
        where = "byte " + std::to_string(kLengthBytes + p->byte) + ": ";
      fail(where + "expected a JSON header, found: " + e.what());
    }
  }

  std::map<std::string, std::string> read_metadata(const json& value) const {
    if (!value.is_object()) fail("__metadata__: expected an object of strings, found " + found(value));
    std::map<std::string, std::string> metadata;
    for (const auto& [key, text] : value.items()) {
      if (!text.is_string()) fail("__metadata__ \"" + key + "\": expected a string, found " + found(text));
      metadata[key] = text.get<std::string>();
    }
    return metadata;
  }

  static std::string found(const json& value) {
    std::string text = value.dump(-1, ' ', true, json::error_handler_t::replace);
    if (text.size() > 60) text = text.substr(0, 60) + "...";
    return text;
  }

  const json& member(const std::string& tensor, const json& value, const char* key) const {
    if (!value.is_object()) fail(tensor, "expected an object, found " + found(value));
    const auto at = value.find(key);
    if (at == value.end())
      fail(tensor, "expected the key \"" + std::string(key) + "\", found " + found(value));
    return *at;
  }

  Shape read_shape(const std::string& tensor, const json& value) const {
    if (!value.is_array() || value.size() > static_cast<std::size_t>(Shape::kMaxRank))
      fail(tensor, "shape: expected an array of at most " + std::to_string(Shape::kMaxRank) +
                       " extents, found " + found(value));
    std::vector<Index> dims;
    for (const json& extent : value) {
      if (!extent.is_number_unsigned() || extent.get<std::uint64_t>() > std::uint64_t{1} << 62)
        fail(tensor, "shape: expected integers from 0 to 2^62, found " + found(value));
      dims.push_back(extent.get<Index>());
    }
    try {
      return Shape(dims);
    } catch (const ShapeError&) {  // a product that overflows
      fail(tensor, "shape: expected at most 2^62 bytes, found " + found(value));
    }
  }

  /// Returns the bytes of a tensor of this shape.
  std::uint64_t size_of(const std::string& tensor, const Shape& shape, std::uint64_t element) const {
    std::uint64_t size = 0;
    if (__builtin_mul_overflow(static_cast<std::uint64_t>(shape.size()), element, &size) ||
        size > std::uint64_t{1} << 62)
      fail(tensor, "shape: expected at most 2^62 bytes, found " + shape.str());
    return size;
  }
};

struct Placed {
  SafetensorsFile::Entry entry;
  std::uint64_t begin, end;
};

Placed read_entry(const Reader& r, const std::string& name, const json& value) {
  const json& dtype = r.member(name, value, "dtype");
  const json& offsets = r.member(name, value, "data_offsets");
  Placed p{{name,
            dtype.is_string() ? dtype.get<std::string>() : "",
            r.read_shape(name, r.member(name, value, "shape")),
            {}},
           0,
           0};
  const std::uint64_t element = element_bytes(p.entry.dtype);
  if (element == 0)
    r.fail(name,
           "dtype: expected BOOL, U8, I8, F8_E5M2, F8_E4M3, U16, I16, F16, BF16, U32, I32, F32, U64, I64 or "
           "F64, found " +
               Reader::found(dtype));
  const bool two = offsets.is_array() && offsets.size() == 2 && offsets[0].is_number_unsigned() &&
                   offsets[1].is_number_unsigned();
  if (two) {
    p.begin = offsets[0].get<std::uint64_t>();
    p.end = offsets[1].get<std::uint64_t>();
  }
  if (!two || p.begin > p.end || p.end > r.data)
    r.fail(name, "data_offsets: expected [begin, end] within the " + std::to_string(r.data) +
                     " bytes of data, found " + Reader::found(offsets));
  const std::uint64_t want = r.size_of(name, p.entry.shape, element);
  if (p.end - p.begin != want)
    r.fail(name, "data_offsets: expected " + std::to_string(want) + " bytes for " + p.entry.dtype + " " +
                     p.entry.shape.str() + ", found " + std::to_string(p.end - p.begin));
  return p;
}

/// Sorts the tensors by position and requires that they cover the data without gap or overlap.
void check_cover(const Reader& r, std::vector<Placed>& placed) {
  std::stable_sort(placed.begin(), placed.end(), [](const Placed& a, const Placed& b) {
    return std::pair(a.begin, a.end) < std::pair(b.begin, b.end);
  });
  std::uint64_t at = 0;
  for (const Placed& p : placed) {
    if (p.begin != at)
      r.fail(p.entry.name, "data_offsets: expected to begin at " + std::to_string(at) +
                               ", the end of the one before (no gap, no overlap), found " +
                               std::to_string(p.begin));
    at = p.end;
  }
  if (at != r.data)
    r.fail("byte " + std::to_string(kLengthBytes + r.header + at) + ": expected the end of the file, found " +
           std::to_string(r.data - at) + " more bytes that belong to no tensor");
}

template <class T>
void append(SafetensorsFile& file, std::string_view name, const char* dtype, Shape shape,
            std::span<const T> data) {
  if (name == kMetadata || file.has(name))
    throw ValueError("[SafetensorsFile::add] name must be new and not __metadata__, got " +
                     std::string(name));
  if (static_cast<Index>(data.size()) != shape.size())
    throw ShapeError("[SafetensorsFile::add] data of " + std::string(name) + " must have the " +
                     std::to_string(shape.size()) + " elements of shape " + shape.str() + ", got " +
                     std::to_string(data.size()));
  const auto bytes = std::as_bytes(data);
  file.tensors.push_back({std::string(name), dtype, shape, {bytes.begin(), bytes.end()}});
}

template <class T>
std::vector<T> elements(const SafetensorsFile& file, std::string_view name, std::string_view dtype) {
  const auto& e = file.at(name);
  if (e.dtype != dtype)
    throw IoError("[safetensors] " + file.path + ": tensor \"" + e.name + "\": expected dtype " +
                  std::string(dtype) + ", found " + e.dtype);
  std::vector<T> out(e.data.size() / sizeof(T));
  if (!out.empty()) std::memcpy(out.data(), e.data.data(), e.data.size());
  return out;
}

float widen_half(std::uint16_t h) {
  const std::uint32_t sign = static_cast<std::uint32_t>(h & 0x8000) << 16, body = h & 0x7fffu;
  // In the fields of a float, the exponent is 112 too small, or 224 for infinities and NaN. The product with
  // a power of 2 also normalises the subnormals of half.
  const float magnitude = body >= 0x7c00u ? std::bit_cast<float>((body << 13) + (224u << 23))
                                          : std::bit_cast<float>(body << 13) * 0x1p112f;
  return std::bit_cast<float>(std::bit_cast<std::uint32_t>(magnitude) | sign);
}

}  // namespace

SafetensorsFile SafetensorsFile::parse(std::span<const std::byte> bytes, std::string_view name) {
  Reader reader{std::string(name)};
  const json header = reader.parse_header(reader.header_text(bytes));
  SafetensorsFile file;
  file.path = name;
  std::vector<Placed> placed;
  for (const auto& [key, value] : header.items()) {
    if (key == kMetadata)
      file.metadata = reader.read_metadata(value);
    else
      placed.push_back(read_entry(reader, key, value));
  }
  check_cover(reader, placed);
  const auto data = bytes.subspan(kLengthBytes + static_cast<std::size_t>(reader.header));
  for (Placed& p : placed) {
    const auto part =
        data.subspan(static_cast<std::size_t>(p.begin), static_cast<std::size_t>(p.end - p.begin));
    p.entry.data.assign(part.begin(), part.end());
    file.tensors.push_back(std::move(p.entry));
  }
  return file;
}

SafetensorsFile SafetensorsFile::read(const std::filesystem::path& path) {
  return parse(read_bytes(path), path.string());
}

void SafetensorsFile::write(const std::filesystem::path& to, Access access) const {
  std::vector<const Entry*> order;
  for (const Entry& e : tensors) order.push_back(&e);
  std::stable_sort(order.begin(), order.end(), [](const Entry* a, const Entry* b) {
    return element_bytes(a->dtype) > element_bytes(b->dtype);
  });
  json header = json::object();
  if (!metadata.empty()) header[kMetadata] = metadata;
  std::size_t at = 0;
  for (const Entry* e : order) {
    json shape = json::array();
    for (int k = 0; k < e->shape.rank(); ++k) shape.push_back(e->shape[k]);
    header[e->name] = {{"dtype", e->dtype}, {"shape", shape}, {"data_offsets", {at, at + e->data.size()}}};
    at += e->data.size();
  }
  std::string text;
  try {
    text = header.dump();
  } catch (const json::exception& e) {
    throw ValueError("[SafetensorsFile::write] names and metadata must be UTF-8, got: " +
                     std::string(e.what()));
  }
  text.append((8 - text.size() % 8) % 8, ' ');
  const std::uint64_t length = text.size();
  AtomicFile file(to, access);
  file.write(std::as_bytes(std::span(&length, 1)));
  file.write(std::as_bytes(std::span(text)));
  for (const Entry* e : order) file.write(e->data);
  file.commit();
}

#define FIELDMARK_ADD(T, dtype)                                                            \
  void SafetensorsFile::add(std::string_view name, Shape shape, std::span<const T> data) { \
    append(*this, name, dtype, shape, data);                                               \
  }
FIELDMARK_ADD(float, "F32")
FIELDMARK_ADD(double, "F64")
FIELDMARK_ADD(std::uint8_t, "U8")
FIELDMARK_ADD(std::int32_t, "I32")
FIELDMARK_ADD(std::int64_t, "I64")
FIELDMARK_ADD(std::uint64_t, "U64")

bool SafetensorsFile::has(std::string_view name) const {
  return std::any_of(tensors.begin(), tensors.end(), [&](const Entry& e) { return e.name == name; });
}

const SafetensorsFile::Entry& SafetensorsFile::at(std::string_view name) const {
  for (const Entry& e : tensors)
    if (e.name == name) return e;
  std::string names;
  for (std::size_t i = 0; i < std::min<std::size_t>(tensors.size(), 20); ++i)
    names += (i ? ", " : "") + tensors[i].name;
  throw IoError("[safetensors] " + path + ": expected a tensor \"" + std::string(name) + "\", found " +
                std::to_string(tensors.size()) + ": " + names + (tensors.size() > 20 ? ", ..." : ""));
}

Tensor<float> SafetensorsFile::f32(std::string_view name) const {
  const Entry& e = at(name);
  if (e.dtype != "F16" && e.dtype != "BF16") return {e.shape, elements<float>(*this, name, "F32")};
  Tensor<float> out(e.shape);
  const auto halves = elements<std::uint16_t>(*this, name, e.dtype);
  std::transform(halves.begin(), halves.end(), out.data.begin(), [&](std::uint16_t h) {
    return e.dtype == "F16" ? widen_half(h) : std::bit_cast<float>(static_cast<std::uint32_t>(h) << 16);
  });
  return out;
}

Tensor<double> SafetensorsFile::f64(std::string_view name) const {
  return {at(name).shape, elements<double>(*this, name, "F64")};
}
std::vector<std::uint8_t> SafetensorsFile::u8(std::string_view name) const {
  return elements<std::uint8_t>(*this, name, "U8");
}
std::vector<std::int32_t> SafetensorsFile::i32(std::string_view name) const {
  return elements<std::int32_t>(*this, name, "I32");
}
std::vector<std::int64_t> SafetensorsFile::i64(std::string_view name) const {
  return elements<std::int64_t>(*this, name, "I64");
}
std::vector<std::uint64_t> SafetensorsFile::u64(std::string_view name) const {
  return elements<std::uint64_t>(*this, name, "U64");
}

}  // namespace fieldmark
