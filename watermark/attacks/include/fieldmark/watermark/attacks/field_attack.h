#pragma once
#include <fieldmark/engine/random.h>
#include <fieldmark/nerf/radiance_field.h>

#include <string>
#include <string_view>
#include <vector>

namespace fieldmark::watermark {

/// Kinds of attack on a field's tensors; parse_field_attack() describes each.
enum class FieldAttackKind {
  weights_noise,
  float16,
  integers,
  integer_blocks,
  prune,
  greyscale,
  hue,
  brightness,
  contrast,
  average,
  sign_flip,
  copy
};

/// Attack on a field's tensors that removes the mark or copies it elsewhere.
struct FieldAttack {
  /// A kind and its severity.
  struct Step {
    FieldAttackKind kind;  ///< of attack
    double amount;         ///< severity, in the unit that parse_field_attack() gives for the kind; 0: none
  };
  std::string name;         ///< as given
  std::vector<Step> steps;  ///< from left to right
  /// True if any step is of this kind.
  bool has(FieldAttackKind kind) const;
};

/// Parses a comma-separated chain of names. "Each tensor" means each float tensor of a FIELD; occupancy is
/// unchanged.
///   weights_noise_A  w + A rms(tensor) n, n normal, 0 to 10
///   float16          rounded to half precision, ties to even; beyond its range the largest half
///   intB             B of 2 to 8 bits: s round(w / s), s = max |tensor| / (2^(B-1) - 1), one s per tensor
///   intB-blocks      the same with one s for each 32 successive elements
///   prune_A          the fraction A of smallest magnitude in each tensor becomes 0, 0 to 1
///   greyscale        the last colour layer's logits become 0.299 r + 0.587 g + 0.114 b
///   hue_A            those logits rotated about the grey axis by A degrees, -360 to 360
///   brightness_A     those logits plus ln A: odds c / (1 - c) of every colour times A, 0.01 to 100
///   contrast_A       those logits times A, 0 to 10
/// The following need other fields of the same sizes (FieldAttackInputs):
///   average_A        w + A (other - w), 0 to 1: two copies or messages of one owner mixed
///   sign_flip_A      w + A (unmarked - w), 0 to 4: 1 removes the mark, 2 reverses all its signs.
///                    The attacker needs the unmarked field but no carrier
///   copy_A           w + A (marked - unmarked), -4 to 4: another field's mark added to this field
/// @throws ValueError that lists all names, for an unknown name or an amount out of range
FieldAttack parse_field_attack(std::string_view name);

/// Other fields that some attacks need.
struct FieldAttackInputs {
  const nerf::RadianceField* other = nullptr;     ///< of average
  const nerf::RadianceField* unmarked = nullptr;  ///< of sign_flip and copy
  const nerf::RadianceField* marked = nullptr;    ///< of copy
};

/// Applies the steps in order. Cameras, bounds, background and occupancy are unchanged.
/// @param rng  of the noise, by step, tensor and element: results do not depend on the number of threads
/// @throws ValueError if a field that a step needs is missing, or its tensors have other names or shapes
nerf::RadianceField apply_field_attack(const FieldAttack& attack, const nerf::RadianceField& field,
                                       const CounterRng& rng, const FieldAttackInputs& inputs = {});

}  // namespace fieldmark::watermark
