#pragma once
#include <fieldmark/engine/adam.h>
#include <fieldmark/engine/params.h>
#include <fieldmark/engine/safetensors.h>
#include <fieldmark/engine/sgd.h>

#include <string_view>

namespace fieldmark {

// The state of training in a safetensors file: parameters by name, trained and running ones, and what the
// optimiser keeps for them. Several stores share a file under prefixes of their own.

/// @{
/// Adds the parameters as PREFIX + NAME; with Adam its moments as NAME.mean and NAME.mean_square and its
/// steps as PREFIX + "adam/steps", with Sgd its velocity as NAME.velocity.
/// @throws ValueError if a name is taken
template <class T>
void save_state(SafetensorsFile& file, std::string_view prefix, const ParamStore<T>& store);
template <class T>
void save_state(SafetensorsFile& file, std::string_view prefix, const ParamStore<T>& store,
                const Adam<T>& optimiser);
template <class T>
void save_state(SafetensorsFile& file, std::string_view prefix, const ParamStore<T>& store,
                const Sgd<T>& optimiser);
/// @}

/// @{
/// Reads what save_state() added; further arrays of the file are left alone. Training then goes on with the
/// same bits.
/// @throws IoError if an array is missing or has another shape or type; nothing is changed then
/// @throws ShapeError if the optimiser is for another number of parameters
template <class T>
void load_state(const SafetensorsFile& file, std::string_view prefix, ParamStore<T>& store);
template <class T>
void load_state(const SafetensorsFile& file, std::string_view prefix, ParamStore<T>& store,
                Adam<T>& optimiser);
template <class T>
void load_state(const SafetensorsFile& file, std::string_view prefix, ParamStore<T>& store,
                Sgd<T>& optimiser);
/// @}

}  // namespace fieldmark
