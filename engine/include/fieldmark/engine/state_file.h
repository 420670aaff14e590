#pragma once
#include <fieldmark/engine/adam.h>
#include <fieldmark/engine/muon.h>
#include <fieldmark/engine/params.h>
#include <fieldmark/engine/safetensors.h>
#include <fieldmark/engine/sgd.h>

#include <string_view>

namespace fieldmark {

// The state of training in a safetensors file: trained and running parameters by name, and the optimiser's
// state for them. Several stores can share a file, each under its own prefix.

/// An optimiser whose state is a velocity: Sgd or Muon.
template <class O>
concept HasVelocity = requires(O& optimiser) {
  optimiser.velocity();
};

/// @{
/// Adds the parameters as PREFIX + NAME. Adam adds its moments as NAME.mean and NAME.mean_square and its
/// steps as PREFIX + "adam/steps"; Sgd and Muon add their velocity as NAME.velocity.
/// Two optimisers of one store need two prefixes; the parameters are then stored twice.
/// @throws ValueError if a name is taken
template <class T>
void save_state(SafetensorsFile& file, std::string_view prefix, const ParamStore<T>& store);
template <class T>
void save_state(SafetensorsFile& file, std::string_view prefix, const ParamStore<T>& store,
                const Adam<T>& optimiser);
template <class T, template <class> class Optimiser>
requires HasVelocity<Optimiser<T>>
void save_state(SafetensorsFile& file, std::string_view prefix, const ParamStore<T>& store,
                const Optimiser<T>& optimiser);
/// @}

/// @{
/// Reads what save_state() added and ignores other arrays of the file. Training then continues with the same
/// bits.
/// @throws IoError if an array is missing or has another shape or type; nothing changes then
/// @throws ShapeError if the optimiser is for another number of parameters
template <class T>
void load_state(const SafetensorsFile& file, std::string_view prefix, ParamStore<T>& store);
template <class T>
void load_state(const SafetensorsFile& file, std::string_view prefix, ParamStore<T>& store,
                Adam<T>& optimiser);
template <class T, template <class> class Optimiser>
requires HasVelocity<Optimiser<T>>
void load_state(const SafetensorsFile& file, std::string_view prefix, ParamStore<T>& store,
                Optimiser<T>& optimiser);
/// @}

}  // namespace fieldmark
