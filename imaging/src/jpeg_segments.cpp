#include "jpeg_segments.h"

#include <algorithm>
#include <array>
#include <map>

namespace fieldmark {
namespace {

constexpr int kStart = 0xd8, kEnd = 0xd9, kScan = 0xda, kProgressive = 0xc2, kTables = 0xc4,
              kQuantisation = 0xdb, kTemporary = 0x01;
constexpr std::size_t kCoefficients = 64;

using Bytes = std::span<const std::byte>;

int at(Bytes bytes, std::size_t i) { return std::to_integer<int>(bytes[i]); }

bool is_restart(int marker) { return marker >= 0xd0 && marker <= 0xd7; }
bool is_frame(int marker) {
  return marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 && marker != 0xcc;
}

bool stands_alone(int marker) { return marker == kStart || marker == kTemporary || is_restart(marker); }

// Returns the position of the next marker; the size if there is none. In scan data FF is followed by 00, and
// FF may repeat before a marker. Skips other bytes between segments, as stb does.
std::size_t next_marker(Bytes bytes, std::size_t i) {
  for (; i + 1 < bytes.size(); ++i)
    if (at(bytes, i) == 0xff && at(bytes, i + 1) != 0 && at(bytes, i + 1) != 0xff) return i;
  return bytes.size();
}

}  // namespace

bool is_jpeg(Bytes bytes) { return bytes.size() >= 2 && at(bytes, 0) == 0xff && at(bytes, 1) == kStart; }

JpegSegments jpeg_segments(Bytes bytes) {
  JpegSegments found{.end = bytes.size()};
  std::size_t i = 0;
  for (;;) {
    i = next_marker(bytes, i);
    if (i >= bytes.size()) return found;
    const int marker = at(bytes, i + 1);
    i += 2;
    if (stands_alone(marker)) continue;
    if (marker == kEnd) {
      found.end = i;
      found.complete = true;
      return found;
    }
    if (i + 2 > bytes.size()) return found;
    const auto length = static_cast<std::size_t>(at(bytes, i) << 8 | at(bytes, i + 1));
    if (length < 2 || length > bytes.size() - i) return found;
    found.segments.push_back({marker, bytes.subspan(i + 2, length - 2)});
    i += length;
  }
}

namespace {

// The tables that the segments so far have defined: [class][number] of Huffman tables, [number] of the
// others.
struct Tables {
  std::array<std::array<bool, 16>, 2> huffman{};
  std::array<bool, 16> quantisation{};

  void add(const JpegSegment& s) {
    for (std::size_t i = 0; i < s.payload.size();) {
      const auto number = static_cast<std::size_t>(at(s.payload, i) & 15);
      const int high = at(s.payload, i) >> 4;
      if (s.marker == kQuantisation) {
        quantisation[number] = true;
        i += 1 + (high ? 2 : 1) * kCoefficients;
      } else {
        std::size_t symbols = 0;
        for (std::size_t k = i + 1; k <= i + 16 && k < s.payload.size(); ++k)
          symbols += static_cast<std::size_t>(at(s.payload, k));
        huffman[high ? 1 : 0][number] = true;
        i += 17 + symbols;
      }
    }
  }
  // True if the tables of a scan's components are there; quantised: their quantisation tables by component.
  bool serve(Bytes scan, const std::map<int, std::size_t>& quantised, bool progressive) const {
    const auto components = static_cast<std::size_t>(at(scan, 0));
    if (scan.size() != 4 + 2 * components) return true;  // such a scan is refused for its size
    const int first = at(scan, scan.size() - 3), last = at(scan, scan.size() - 2),
              bits = at(scan, scan.size() - 1);
    const bool dc = !progressive || (first == 0 && bits >> 4 == 0), ac = !progressive || last > 0;
    for (std::size_t c = 0; c < components; ++c) {
      const int tables = at(scan, 2 + 2 * c);
      const auto found = quantised.find(at(scan, 1 + 2 * c));
      if (found == quantised.end() || !quantisation[found->second]) return false;
      if (dc && !huffman[0][static_cast<std::size_t>(tables >> 4)]) return false;
      if (ac && !huffman[1][static_cast<std::size_t>(tables & 15)]) return false;
    }
    return true;
  }
};

}  // namespace

bool JpegSegments::defines_tables() const {
  Tables tables;
  std::map<int, std::size_t> quantised;
  bool progressive = false;
  for (const JpegSegment& s : segments) {
    if (s.marker == kTables || s.marker == kQuantisation) tables.add(s);
    if (is_frame(s.marker)) {
      if (s.marker > kProgressive) return true;  // lossless or arithmetic, which stb refuses
      progressive = s.marker == kProgressive;
      for (std::size_t c = 6; c + 2 < s.payload.size(); c += 3)
        quantised[at(s.payload, c)] = static_cast<std::size_t>(at(s.payload, c + 2) & 15);
    }
    if (s.marker == kScan && !s.payload.empty() && !tables.serve(s.payload, quantised, progressive))
      return false;
  }
  return true;
}

bool huffman_tables_fit(Bytes bytes) {
  constexpr std::size_t kLengths = 16;  // of codes; a table starts with its number and their counts
  constexpr int kSymbols = 255;
  const auto byte = [&](std::size_t i) { return i < bytes.size() ? at(bytes, i) : 0; };
  for (std::size_t i = next_marker(bytes, 0); i < bytes.size(); i = next_marker(bytes, i)) {
    const int marker = at(bytes, i + 1);
    i += 2;
    if (stands_alone(marker)) continue;
    const auto length = static_cast<std::size_t>(byte(i) << 8 | byte(i + 1));
    if (marker == kEnd || length < 2) return true;
    const std::size_t end = i + length;
    for (std::size_t table = i + 2; marker == kTables && table < end;) {
      int symbols = 0;
      for (std::size_t k = 1; k <= kLengths; ++k) symbols += byte(table + k);
      if (symbols > kSymbols) return false;
      table += 1 + kLengths + static_cast<std::size_t>(symbols);
    }
    i = end;
  }
  return true;
}

bool JpegSegments::sends_every_coefficient() const {
  std::map<int, std::array<bool, kCoefficients>> sent;  // by component
  bool progressive = false;
  for (const auto& [marker, payload] : segments) {
    if (is_frame(marker)) {
      progressive = marker == kProgressive;
      for (std::size_t c = 6; c + 2 < payload.size(); c += 3) sent[at(payload, c)];
    }
    if (marker != kScan || payload.empty()) continue;
    const auto components = static_cast<std::size_t>(at(payload, 0));
    if (payload.size() != 4 + 2 * components) continue;
    const Bytes last = payload.last(3);
    if (progressive && (at(last, 2) & 15) != 0) continue;  // lower bits follow in another scan
    const int from = progressive ? at(last, 0) : 0, to = progressive ? at(last, 1) : 63;
    for (std::size_t c = 0; c < components; ++c)
      for (int k = from; k <= std::min(to, 63); ++k)
        sent[at(payload, 1 + 2 * c)][static_cast<std::size_t>(k)] = true;
  }
  return !sent.empty() && std::ranges::all_of(sent, [](const auto& component) {
    return std::ranges::all_of(component.second, [](bool b) { return b; });
  });
}

}  // namespace fieldmark
