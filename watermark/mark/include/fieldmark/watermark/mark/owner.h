#pragma once
#include <fieldmark/extractor/dense_extractor.h>
#include <fieldmark/extractor/pooled_extractor.h>
#include <fieldmark/nerf/renderer.h>
#include <fieldmark/watermark/mark/cell_code.h>
#include <fieldmark/watermark/mark/cell_grid.h>
#include <fieldmark/watermark/mark/global_mark.h>
#include <fieldmark/watermark/mark/mark_network.h>
#include <fieldmark/watermark/mark/object_window.h>

#include <optional>
#include <string_view>

namespace fieldmark::watermark {

/// How a mark is made and read.
enum class Preset {
  fast,   ///< every cell of the scene carries a bit (MarkNetwork, DenseExtractor): trains in minutes
  paper,  ///< one message fused into every colour, one pooled reading (GlobalMark, PooledExtractor)
  code    ///< the same as the authors' code has it, see owner_options() and embed_options()
};
/// "fast", "paper" or "code".
const char* preset_name(Preset preset);
/// @throws ValueError if the name is none of them
Preset parse_preset(std::string_view name);

/// How a mark is made: fixed when it is, and kept in the OWNER.
struct OwnerOptions {
  Preset preset = Preset::fast;  ///< which networks
  Index bits = 16;               ///< length of a message, 1 to 256
  double mark_psnr =
      36.5;          ///< PSNR of marked against unmarked on the object, dB, mean over novel views, 20 to 60
  Index cells = 16;  ///< per axis of the field's cube, see CellGrid
  Index reader_size = 160;     ///< longer side of what the extractor sees, pixels, >= 32
  double reader_aspect = 1;    ///< width over height of what it sees, 1/4 to 4, see reader_aspect()
  MarkNetworkOptions mark{};   ///< preset fast
  Index base_channels = 32;    ///< of the extractor, see DenseExtractorOptions
  Index width = 256;           ///< presets paper and code: units of E and G, and N_c, see GlobalMarkOptions
  Index message_features = 0;  ///< likewise: N_m; 0: width
  MarkFusion fusion{};         ///< likewise: what goes where
  Index channels = 64;         ///< likewise: of the extractor, see PooledExtractorOptions
  /// Likewise: whether there is a GlobalMark. Without, EmbedOptions::image says what a message does.
  bool colours = true;
  /// Likewise: c + g (c_m - c) in place of c_m, at `strength`, and a budget of power in place of the content
  /// loss: as preset fast, without its cells.
  bool budget = false;
  bool keyed_signs = true;  ///< whether a bit's sign in a cell is the key's, or always the bit's own
  std::uint64_t seed = 0;   ///< of the initial numbers of the networks
  /// What the extractor sees: its shorter side is the multiple of 8 pixels nearest to the shape of
  /// reader_aspect, but not below 16.
  PatchSize patch() const;
};

/// The shape of the part of an image that the extractor best sees: the shape of the field's photographs,
/// within 1/4 to 4, where a scene fills them (its space is contracted or ndc); of an object in a cube, before
/// a plain background, a square.   @return width over height
double reader_aspect(const nerf::RadianceField& field);

/// The options of a preset: the defaults for fast and paper. For code the networks of the authors' code, row
/// by row of its differences to the paper: N_m is 128, and D has as many units (message_features); E and G
/// read raw numbers (fusion.raw_colour), G reads them and M again before each hidden layer (fusion.repeated),
/// and the direction enters G (fusion.late_direction). The rows on training are embed_options(); those that
/// the paper leaves open (nine convolutions, N_c = 256, no residual) are alike in both. An image is read by
/// its own batch statistics in both, too: the paper says nothing of it.
OwnerOptions owner_options(Preset preset);

/// For presets paper and code: slots without a place take the part of cells, one for each bit and all of the
/// same area, so that order and signs of the bits are the key's there too.   @param bits  at least 1
CellGrid message_slots(Index bits);

/// Everything the owner keeps secret: the unmarked field, the mark's networks, the extractor, the cells and
/// the key.
class Owner {
 public:
  /// @param grid  the cells of the scene, or message_slots() for presets paper and code   @throws ValueError
  /// if an option is out of range, or those presets have another number of slots than bits
  Owner(nerf::RadianceField base, const OwnerOptions& options, const Key& owner_key, CellGrid grid);

  /// Which bits and signs the cells carry under the owner's key, or under another.
  CellCode code() const { return code(key); }
  /// The same under another key.
  CellCode code(const Key& other) const;

  /// Colours of the marked field of one message, not yet baked. Preset fast adds the residual g s(x) P(x, c)
  /// to them and keeps them in [0, 1]; presets paper and code put c_m in their place.
  /// @param signs  of the cells, see cell_signs()   @return a function for Renderer::set_recolour; this must
  /// outlive it   @throws ValueError if the options' `colours` is off
  nerf::Renderer::Recolour marking(std::vector<std::int8_t> signs) const;

  /// Makes the mark fainter or stronger than it was calibrated, without learning again: as the PSNR on the
  /// object that options().strength counts in, dB, 20 to 60. Only for the life of this object.
  /// @throws ValueError if it is outside, or the mark has no gain: presets paper and code without a budget
  void set_mark_psnr(double mark_psnr);

  /// What a GlobalMark reads of n colours: themselves or, with fusion.raw_colour, the logit of each, cut off
  /// at those of 1e-3 and 1 - 1e-3, and a sixteenth of the field's log sigma at x. @return [n, 3] or [n, 4]
  std::vector<float> fusion_colours(const float* x, const float* rgb, Index n) const;

  /// Writes an OWNER. @throws IoError
  void save(const std::filesystem::path& path) const;
  /// @throws IoError if the file is missing, foreign, of another kind, or its tensors do not fit its
  /// configuration
  static Owner load(const std::filesystem::path& path);

  /// As constructed.
  const OwnerOptions& options() const { return options_; }

  nerf::RadianceField field;                                       ///< unmarked
  Key key;                                                         ///< which deals the cells
  CellGrid cells;                                                  ///< or slots, see message_slots()
  ParamStore<float> params;                                        ///< mark network and extractor
  std::optional<MarkNetwork<float>> mark;                          ///< preset fast
  std::optional<extractor::DenseExtractor<float>> reader;          ///< preset fast
  double gain = 0;                                                 ///< g; preset fast, and under a budget
  std::optional<GlobalMark<float>> global_mark;                    ///< presets paper and code
  std::optional<extractor::PooledExtractor<float>> pooled_reader;  ///< presets paper and code

 private:
  OwnerOptions options_;
};

}  // namespace fieldmark::watermark
