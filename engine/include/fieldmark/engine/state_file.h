#pragma once
#include <fieldmark/engine/adam.h>
#include <fieldmark/engine/muon.h>
#include <fieldmark/engine/params.h>
#include <fieldmark/engine/safetensors.h>
#include <fieldmark/engine/sgd.h>

#include <string_view>

namespace fieldmark {

// The state of training in a safetensors file: trained and running parameters by name, and the optimiser's
// state for them. Several stores can share a file, each under its own prefix. A module is the parameters that
// a layer or a larger part of a model added under its name.

/// An optimiser whose state is a velocity: Sgd or Muon.
template <class O>
concept HasVelocity = requires(O& optimiser) {
  optimiser.velocity();
};

/// @{
/// Adds the parameters as PREFIX + NAME. Adam adds its moments as NAME.mean and NAME.mean_square and its
/// steps as PREFIX + "adam/steps"; Sgd and Muon add their velocity as NAME.velocity.
/// Two optimisers of one store need two prefixes; the parameters are then stored twice.
/// @param module  if not empty, adds the parameters "MODULE/NAME" alone, as PREFIX + NAME. Adam's steps,
/// which belong to the whole store, are then not added
/// @throws ValueError if a name is taken, or the store has no parameter of the module
template <class T>
void save_state(SafetensorsFile& file, std::string_view prefix, const ParamStore<T>& store,
                std::string_view module = {});
template <class T>
void save_state(SafetensorsFile& file, std::string_view prefix, const ParamStore<T>& store,
                const Adam<T>& optimiser, std::string_view module = {});
template <class T, template <class> class Optimiser>
requires HasVelocity<Optimiser<T>>
void save_state(SafetensorsFile& file, std::string_view prefix, const ParamStore<T>& store,
                const Optimiser<T>& optimiser, std::string_view module = {});
/// @}

/// @{
/// Reads what save_state() added and ignores other arrays of the file. Training from the state of a
/// whole store continues with the same bits; after a module alone, Adam corrects its bias by the steps that
/// the receiving optimiser has taken.
/// @param module  if not empty, reads PREFIX + NAME into the parameters "MODULE/NAME" and leaves all others,
/// and Adam's steps, as they are. The prefix "PREFIX" + "MODULE/" reads it from the state of a whole store
/// @throws IoError if an array is missing or has another shape or type; nothing changes then
/// @throws ShapeError if the optimiser is for another number of parameters
/// @throws ValueError if the store has no parameter of the module
template <class T>
void load_state(const SafetensorsFile& file, std::string_view prefix, ParamStore<T>& store,
                std::string_view module = {});
template <class T>
void load_state(const SafetensorsFile& file, std::string_view prefix, ParamStore<T>& store,
                Adam<T>& optimiser, std::string_view module = {});
template <class T, template <class> class Optimiser>
requires HasVelocity<Optimiser<T>>
void load_state(const SafetensorsFile& file, std::string_view prefix, ParamStore<T>& store,
                Optimiser<T>& optimiser, std::string_view module = {});
/// @}

}  // namespace fieldmark
